"""The studio: a page in the browser, and an API beside it, of what `handout.pipeline` does.

The server does no work itself and imports nothing numeric: every call of the pipeline runs in another process, which
may be cancelled, may take as long as it takes, and may end without taking the server along.  Files:

    server.py     the application and its start: which routes there are, where it listens, how it ends
    guard.py      who is let in: Host, Origin, session, bounds on bodies and on how often; headers of every answer
    studio.py     what the routes share: sessions, uploads, the names of hands, the lanes of work
    workers.py    tasks, and the processes that they run in; worker.py is such a process
    calls.py      what may be asked for, as typed bodies, and the options of the pipeline that they mean
    routes.py     the table of routes, from which requests are served and `openapi.json` is made
    tasks.py      routes of sessions, uploads and tasks
    writing.py    routes of the page Write; hands.py of Hands; letters.py of Letters, where a scanned hand is corrected;
                  styles.py of Style; calibration.py of Calibration
    webhooks.py   how batches ended, told to who asked for that
    jobs.py       routes of the pages Plotter and Letters from a table: machines, the pen by hand, plots, batches
    static/       the page: HTML, CSS and ES modules, as they are served

A page is added as a file of routes with a table `ROUTES`, its line in `server.TABLES`, a module in `static/` and its
line in `PAGES` of `static/studio.js`; behind which door it is says `DOORS` there.
"""
