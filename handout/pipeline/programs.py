"""Programs of plotters as files: which machine a suffix is for, and how its dialect writes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from handout.errors import InputError

if TYPE_CHECKING:
    from handout.pipeline.plot_request import HookOptions
    from handout.profiles import Plotter
    from handout.values import Drawing

# of such files, for help texts; `plotting.dialects.usual_devices` says which plotter each is for if none is named
SUFFIXES = (".gcode", ".nc", ".ngc", ".g", ".gco", ".hpgl", ".plt", ".ebb")


def check_suffixes(outputs: Sequence[str | Path]) -> None:
    """Raise InputError for the first file that is no program of a plotter."""
    for path in map(Path, outputs):
        if path.suffix.lower() not in SUFFIXES:
            raise InputError(f"{path}: programs of plotters end in {', '.join(SUFFIXES)}; handout write does the rest.")


PageSink = Callable[["Drawing"], bytes]


class Programs:
    """The programs of a job, each for the machine of its suffix or for the one that was named.

    sinks : suffix → what makes a file of a page; see `sinks.write_drawings`.
    seconds : name of the machine → how long all pages made so far would take, s; dips, hooks_s : how often its pen is
        dipped, and what of that time hooks take, s, if there are any.
    shrunk : of pages that were made to fit, their size as a share of that which was asked for.
    """

    def __init__(
        self,
        device: str | None,
        paths: Sequence[Path],
        *,
        fast: bool = False,
        fit: bool = False,
        order: Literal["writing", "travel"] = "writing",
        hooks: HookOptions | None = None,
    ) -> None:
        self.sinks: dict[str, Callable[[Drawing], bytes]] = {suffix: self._sink(suffix) for suffix in SUFFIXES}
        self.seconds: dict[str, float] = {}
        self._fast, self._fit, self._order = fast, fit, order
        wanted = {path.suffix.lower(): path for path in paths if path.suffix.lower() in SUFFIXES}
        plotters = {suffix: _plotter(device, path) for suffix, path in wanted.items()}
        self._plotters = {suffix: apply_hooks(one, hooks) if hooks else one for suffix, one in plotters.items()}
        self.dips: dict[str, int] = {}
        self.hooks_s: dict[str, float] = {}
        self.shrunk: list[float] = []

    def pressed_evenly(self) -> list[str]:
        """Notes on machines that do not press the pen as its pose says."""
        return [note for profile in self._plotters.values() if (note := pressed_evenly(profile))]

    def _sink(self, suffix: str) -> Callable[[Drawing], bytes]:
        def render(drawing: Drawing) -> bytes:
            from handout.plotting import fit_to_bed
            from handout.plotting import plan as make_plan
            from handout.plotting.dialects import dialect

            profile = self._plotters[suffix]
            drawing = fit_to_bed(drawing, profile) if self._fit else drawing
            self.shrunk += drawing.about.get("shrunk", [])
            plan = make_plan(drawing, profile, speed="fast" if self._fast else 1.0, order=self._order)
            self.seconds[profile.name] = self.seconds.get(profile.name, 0.0) + plan.duration
            if plan.hook_time:
                self.dips[profile.name] = self.dips.get(profile.name, 0) + plan.dips
                self.hooks_s[profile.name] = self.hooks_s.get(profile.name, 0.0) + plan.hook_time
            return dialect(profile.dialect).file(plan, profile)

        return render


def apply_hooks(profile: Plotter, options: HookOptions) -> Plotter:
    """The profile with the hooks that are asked for, and checked: their places lie on the bed, their heights exist.

    Raises InputError, DoesNotFit: a hook cannot be read or done.
    """
    import msgspec

    from handout import profiles
    from handout.pipeline.options import millimetres
    from handout.plotting.pen_heights import replace_heights
    from handout.plotting.planning.hooking import check

    given = {
        name: tuple(filter(None, map(str.strip, text.split(";"))))
        for name in profiles.HOOKS
        if (text := getattr(options, name)) is not None
    }
    told = msgspec.structs.replace(profile.hooks, **given)
    if options.dip_every is not None:
        told = msgspec.structs.replace(told, dip_every=profiles.Length(millimetres(options.dip_every, "dip every")))
    elif options.dip == "":
        told = msgspec.structs.replace(told, dip_every=profiles.Length(0.0))
    changed: Plotter = msgspec.structs.replace(profile, hooks=told)
    profiles.check_hooks(changed)
    check(changed)
    for name in profiles.HOOKS:
        for step in told.steps(name):
            if (value := getattr(step, "value", None)) is not None:
                replace_heights(profile, None, value)
    return changed


def pressed_evenly(profile: Plotter) -> str | None:
    """The note that a machine does not press the pen as its pose says, if it does not."""
    if profile.pen.pressed not in (None, profile.pen.down):
        return None
    way = "handout pen heights finds it" if profile.can_press else "such a pen is only lifted and lowered"
    return f"--pose: the pen is pressed evenly, since the profile of {profile.name} has no pen.pressed; {way}."


def _plotter(name: str | None, path: Path) -> Plotter:
    """The machine a file is for, which must speak what the suffix of the file promises."""
    from handout import profiles
    from handout.plotting.dialects import dialect, usual_devices

    profile = profiles.find(name or usual_devices()[path.suffix.lower()], "plotter")
    assert isinstance(profile, profiles.Plotter)
    suffixes = dialect(profile.dialect).suffixes
    if path.suffix.lower() not in suffixes:
        raise InputError(
            f"{path}: {profile.name} speaks {profile.dialect}, whose files end in {' or '.join(suffixes)}; rename the "
            "file or name another --device."
        )
    return profile
