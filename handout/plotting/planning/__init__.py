"""From a drawing to a `Plan`, without a machine: the order of the strokes, their times, what the machine is told.

The steps, in the order in which `planner.plan` takes them:

    planner.py        the steps; which planner a machine needs
    order.py          in which order strokes are drawn, and the shortest way through strokes in any order
    hooking.py        what is done besides drawing, and before which strokes the pen is dipped
    plan.py           what is asked, a `PlanRequest`, at what times, and what comes of it, a `Plan`

and then, by who makes the speeds of the machine, one of three:

    feed_segments.py  controllers with a planner of their own: segments, and feeds fitted to what it makes of them
    time_slices.py    boards that do every move in the time they are told, slowed down where they could not follow
    vectors.py        plotters that draw each stroke at one speed

which share:

    segments.py       a trajectory, and where it is cut into straight segments
    lookahead.py      what a planner of GRBL's kind makes of lines and feeds, and the feeds that suit it
    toolpath.py       all moves of a page, liftings and rests included, and when each begins

To add a step: a function of its own, called in `planner.plan` or in the `plan` of one of the three; to add an order of
strokes: a name in `plan.Order`, and `order.shorten_travel`.
"""
