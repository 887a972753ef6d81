"""The film of one run: `rearview video RUN -o film.mp4`."""

import math
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from experiments.errors import ConfigError, ResultsError
from experiments.report.figures import palette
from experiments.report.figures.outlines import rectangle
from experiments.report.figures.save import require_matplotlib
from experiments.report.run_reader import RunRecord, numbers, read_run
from planner.states import FloatArray

if TYPE_CHECKING:
    from matplotlib.animation import AbstractMovieWriter
    from matplotlib.figure import Figure

FORMATS = (".mp4", ".gif")
SIZE = (9.6, 5.4)  # [in]
RESOLUTION = 100  # [1/in]; even numbers of pixels, as H.264 requires
REACH = (55.0, 28.0)  # half extents of the view around the ego [m]
FRAME_RATE = 20.0  # at most [1/s]


def save_film(
    folder: Path,
    file: Path,
    speed: float = 1.0,
    span: tuple[float, float] = (0.0, math.inf),
) -> Path:
    """Film a run in top view, following the ego.

    Args:
        folder: A run folder.
        file: Where the film goes; `.mp4` or `.gif`.
        speed: How much faster than the run it is.
        span: Begin and end of what is filmed, since the ego entered [s].

    Returns:
        The file written.

    Raises:
        ConfigError: If the suffix is unknown, the speed is not positive, or the span
            has no step.
        ResultsError: If the run cannot be read, the film not be written, or a tool is
            missing.
    """
    kind = file.suffix.lower()
    if kind not in FORMATS:
        raise ConfigError(f"{file}: has no known suffix; allowed: {', '.join(FORMATS)}")
    if not speed > 0.0:
        raise ConfigError(f"--speed: is {speed:g}; allowed: above 0")
    run = read_run(folder)
    inside = (run.time >= span[0] - 1e-6) & (run.time <= span[1] + 1e-6)
    steps = np.flatnonzero(inside).tolist()
    if not steps:
        raise ConfigError(
            f"--from {span[0]:g} --to {span[1]:g}: no step is in it; allowed: within "
            f"{run.time[0]:g} to {run.time[-1]:g}"
        )
    require_matplotlib("video")
    rate, every = _frame_rate(run, speed)
    with _aside(file) as target:
        writer = _writer(kind, rate)
        figure, show = _stage(run)
        with writer.saving(figure, str(target), RESOLUTION):
            for step in steps[::every]:
                show(step)
                writer.grab_frame()
    return file


def _frame_rate(run: RunRecord, speed: float) -> tuple[float, int]:
    """Return the frame rate, and the number of steps per frame."""
    rate = speed / float(run.trace.fact("step_s"))
    every = max(int(np.ceil(rate / FRAME_RATE)), 1)
    return rate / every, every


def _stage(run: RunRecord) -> tuple["Figure", Callable[[int], None]]:
    """Draw the static parts and return a function that draws a step."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure
    from matplotlib.patches import Polygon

    from experiments.report.figures.top_view import draw_road, ego_centre

    figure = Figure(figsize=SIZE)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.06, 0.09, 0.93, 0.83))
    draw_road(axes, run)
    axes.set(xlabel="x [m]", ylabel="y [m]")
    others = PolyCollection([], fc="white", ec=palette.CURVE, lw=0.8, zorder=4)
    axes.add_collection(others)
    (plan,) = axes.plot([], [], color=palette.MOMENTS[1], lw=2.0, zorder=6)
    ego = Polygon(np.zeros((4, 2)), fc=palette.MOMENTS[0], ec="black", zorder=7)
    axes.add_patch(ego)
    title = figure.text(0.06, 0.95, "", parse_math=False)
    fact, steps = run.trace.fact, run.trace.steps
    size = float(fact("length_m")), float(fact("width_m"))
    speeds = numbers(steps["speed_mps"])

    def show(step: int) -> None:
        x, y, heading = ego_centre(run, step)
        ego.set_xy(rectangle(x, y, heading, *size))
        others.set_verts(_bodies(run, step))
        now = run.at(run.trace.plans, step)
        plan.set_data(*(numbers(run.trace.plans[key])[now] for key in ("x_m", "y_m")))
        axes.set_xlim(x - REACH[0], x + REACH[0])
        axes.set_ylim(y - REACH[1], y + REACH[1])
        title.set_text(
            f"{fact('scenario')} · {fact('planner')} · seed {fact('seed')}     "
            f"t = {run.time[step]:4.1f} s     {speeds[step]:4.1f} m/s"
        )

    return figure, show


def _bodies(run: RunRecord, step: int) -> list[FloatArray]:
    """Outline all vehicles of a step."""
    table = run.trace.vehicles
    now = run.at(table, step)
    keys = ("x_m", "y_m", "heading_rad", "length_m", "width_m")
    columns = (numbers(table[key])[now] for key in keys)
    return [rectangle(*body) for body in zip(*columns, strict=True)]


def _writer(kind: str, rate: float) -> "AbstractMovieWriter":
    """Choose the encoder."""
    import matplotlib as mpl
    from matplotlib.animation import FFMpegWriter, PillowWriter

    if kind == ".gif":
        return PillowWriter(fps=max(round(rate), 1))
    mpl.rcParams["animation.ffmpeg_path"] = _ffmpeg()
    options = ["-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    return FFMpegWriter(fps=rate, codec="h264", extra_args=options)  # type: ignore[arg-type]


def _ffmpeg() -> str:
    """Find ffmpeg: that of the system, or the one of imageio-ffmpeg.

    Raises:
        ResultsError: If there is no encoder.
    """
    found = shutil.which("ffmpeg")
    if found is not None:
        return found
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        raise ResultsError(
            "an .mp4 needs ffmpeg, which is not installed; allowed: apt-get install "
            "ffmpeg, pip install imageio-ffmpeg, or -o film.gif"
        ) from error


@contextmanager
def _aside(file: Path) -> Iterator[Path]:
    """Yield a temporary file that is renamed to the target when complete."""
    try:
        descriptor, name = tempfile.mkstemp(
            prefix=".unfinished-", suffix=file.suffix.lower(), dir=file.parent
        )
    except OSError as error:
        raise ResultsError(f"{file}: cannot be written: {error.strerror}") from error
    os.close(descriptor)
    aside = Path(name)
    try:
        yield aside
        aside.chmod(0o644)
        aside.replace(file)
    except OSError as error:
        words = error.strerror or str(error)
        raise ResultsError(f"{file}: cannot be written: {words}") from error
    finally:
        aside.unlink(missing_ok=True)
