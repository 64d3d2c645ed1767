"""From a printed chart to a stored calibration, and pages through it: what a user does about colour.

    wizard           the steps of one calibration, and what it has come to so far, on the disk
    store            the user's calibrations
    pages            charts and strips on their way to the printer
    scanner          scans through SANE
    print_diagnosis  whether the print is one to calibrate with
    pen_reference    the pen in the chart's frame against the hand's own scan
    strip            the verification strip
    verification     what its scan says, in words and pictures
    calibrated_ink   which calibration pages go through, the pages themselves, and samples of ink

The verbs are in `pipeline.calibrating`, the steps as a page asks for them in `pipeline.calibration_desk`.  To add a
step: a member of `wizard.Step`, its method in `Wizard`, its request in `wizard._REQUESTS`, its branch in `_Guide.lead`
of `pipeline.calibrating`, its function in `pipeline.calibration_desk`, and its buttons in `draw` of
`web/static/calibration.js`.

Source: seed 000, §7.1.
"""
