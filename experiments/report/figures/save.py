"""The figure of a run or a sweep: `rearview figure FOLDER`."""

import os
import tempfile
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from experiments.comparison.results import ALL_RUNS, rows
from experiments.errors import ConfigError, ResultsError
from experiments.report.figures import palette
from experiments.report.figures.page_layout import Page, page_for
from experiments.report.figures.sweep import draw_sweep
from experiments.report.figures.sweep_metric import FigureKind, draw_metric
from experiments.report.figures.swept_metric import swept_metric
from experiments.report.run_reader import RunRecord, read_run
from experiments.storage.atomic_folder import write_atomically
from experiments.sweep.folder import is_sweep, load_sweep_copy, require_sweep

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

FORMATS = ("png", "svg", "pdf")
DEFAULT_NAME = "figure.png"
RESOLUTION = 200  # of bitmaps [1/in]
TITLE_WIDTH = 90  # characters that fit beside the colour bar

_STYLE = palette.STYLE | {
    "legend.fontsize": palette.FONT_SIZE - 0.5,
    "pdf.fonttype": 42,
}
_NO_DATE = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


def save_figure(folder: Path, file: Path | None = None) -> Path:
    """Draw a run or a sweep and save the picture.

    Args:
        folder: A run folder, or the folder of a sweep.
        file: Where the picture goes; its suffix says the format. None puts
            `figure.png` into the run folder.

    Returns:
        The file written.

    Raises:
        ConfigError: If the suffix is unknown.
        ResultsError: If the run cannot be read, the picture not be written, or
            matplotlib is missing.
    """
    target = folder / DEFAULT_NAME if file is None else file
    kind = _format(target)
    run = None if is_sweep(folder) else read_run(folder)
    require_matplotlib("figure")
    from matplotlib import rc_context

    with rc_context(_STYLE):
        figure = draw_sweep(folder) if run is None else draw_run(run)
        _save(figure, target, kind)
    return target


def run_figure(folder: Path) -> "Figure":
    """Draw a run as `save_figure` does, without saving it."""
    run = read_run(folder)
    require_matplotlib("figure")
    from matplotlib import rc_context

    with rc_context(_STYLE):
        return draw_run(run)


def save_metric_figure(
    folder: Path,
    metric: str,
    kind: FigureKind,
    where: str | None = None,
    file: Path | None = None,
) -> tuple[Path, Path]:
    """Draw one metric of a sweep in the width of a column, its data beside it.

    Args:
        folder: Of the sweep.
        metric: Column with numbers, or a rate.
        kind: Of the figure.
        where: SQL condition on the runs.
        file: Where the figure goes; `METRIC_KIND.pdf` in the sweep's folder if None.

    Returns:
        The figure's file, and the CSV file with the numbers in it.

    Raises:
        ConfigError: If suffix, metric or condition is unknown, or the sweep has not
            what the kind needs.
        ResultsError: If there are no runs, or the files cannot be written.
    """
    target = file or folder / f"{metric.replace(' ', '_')}_{kind}.pdf"
    suffix = _format(target)
    require_sweep(folder)
    condition = f" WHERE {where}" if where else ""
    found = rows(folder, f"{ALL_RUNS}{condition}", "--where")
    if not found:
        missing = " that meet --where" if where else " yet"
        raise ResultsError(f"{folder}: holds no runs{missing}")
    planners = [planner.shown for planner in load_sweep_copy(folder).variants]
    chosen = swept_metric(found, metric, planners)
    require_matplotlib("figure")
    from matplotlib import rc_context

    with rc_context(_STYLE):
        drawn = draw_metric(chosen, kind)
        _save(drawn.figure, target, suffix)
    data = target.with_suffix(".csv")
    write_atomically(data, drawn.as_csv())
    return target, data


def save_picture(command: str, file: Path, draw: "Callable[[], Figure]") -> Path:
    """Draw and save a picture of a command; returns its file.

    Raises:
        ConfigError: If the suffix is unknown.
        ResultsError: If it cannot be written, or matplotlib is missing.
    """
    kind = _format(file)
    require_matplotlib(command)
    from matplotlib import rc_context

    with rc_context(_STYLE):
        _save(draw(), file, kind)
    return file


def require_picture(file: Path) -> None:
    """Raise a ConfigError unless a file's suffix is that of a picture."""
    _format(file)


def _format(target: Path) -> str:
    """Return the format of a picture by its suffix."""
    kind = target.suffix.removeprefix(".").lower()
    if kind not in FORMATS:
        allowed = ", ".join(f".{name}" for name in FORMATS)
        raise ConfigError(f"{target}: has no known suffix; allowed: {allowed}")
    return kind


def draw_run(run: RunRecord) -> "Figure":
    """Draw a run: the view from above, and the curves beneath or beside it."""
    from matplotlib.figure import Figure

    from experiments.report.figures.time_series import draw_over_time
    from experiments.report.figures.top_view import draw_from_above, extent

    x_min, x_max, y_min, y_max = extent(run)
    page = page_for((y_max - y_min) / (x_max - x_min))
    figure = Figure(figsize=(page.width, page.height))
    view = figure.add_axes(page.share(page.view))
    panels = [figure.add_axes(page.share(box)) for box in page.panels]
    way = draw_from_above(view, run)
    draw_over_time(panels, run)
    for index, axes in enumerate(panels):
        axes.tick_params(labelbottom=index in page.named)
        axes.set_xlabel("time [s]" if index in page.named else "")
    bar = figure.add_axes(page.share(page.bar))
    figure.colorbar(way, cax=bar, orientation="horizontal")
    bar.tick_params(length=2.0, pad=1.0, labelsize=palette.FONT_SIZE - 1.0)
    bar.set_ylabel("ego [m/s]", rotation=0, ha="right", va="center")
    _title(figure, page, run)
    _legend(figure, page, run)
    return figure


def _title(figure: "Figure", page: Page, run: RunRecord) -> None:
    """Write the title: the run and how it ended."""
    fact = run.trace.fact
    status = fact("status")
    words = (
        f"{fact('scenario')} · {fact('planner')} · seed {fact('seed')} · "
        f"{status}: {fact('reason').removeprefix(status).strip()}"
    )
    figure.text(
        0.05 / page.width,
        1.0 - 0.06 / page.height,
        "\n".join(wrap(words, TITLE_WIDTH, max_lines=1, placeholder=" ...")),
        va="top",
        fontsize=palette.FONT_SIZE + 0.5,
        parse_math=False,
    )


def _legend(figure: "Figure", page: Page, run: RunRecord) -> None:
    """Explain the colours of the moments, and the signs that the figure has."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    from experiments.report.figures.time_series import fallback_steps, waiting_steps
    from experiments.report.figures.top_view import vehicles_shown

    handles: list[Any] = [
        Patch(fc=colour, ec="black", lw=palette.THIN, label=_moment_name(run, k))
        for k, colour in enumerate(palette.MOMENTS[: len(run.moments)])
    ]
    if vehicles_shown(run):
        other = Patch(fc="white", ec="black", lw=palette.MEDIUM, label="other vehicle")
        handles.append(other)
    plan = Line2D([], [], color=palette.CURVE, lw=palette.MEDIUM, label="plan")
    handles.append(plan)
    if len(run.trace.obstacles["id"]):
        handles.append(Patch(fc=palette.OBSTACLE, label="obstacle"))
    edge = Line2D([], [], color=palette.ROAD_EDGE, lw=palette.EDGE, label="road edge")
    handles.append(edge)
    if waiting_steps(run).any():
        handles.append(Patch(fc=palette.WAITING, label="stop line closed"))
    if fallback_steps(run).any():
        sign = Line2D([], [], ls="none", marker="^", ms=4.0, color=palette.CURVE)
        sign.set_label("no fresh plan")
        handles.append(sign)
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.0, 1.0 - 0.24 / page.height),
        ncols=5,
        frameon=False,
        handlelength=1.6,
        columnspacing=1.4,
        borderpad=0.3,
    )


def _moment_name(run: RunRecord, number: int) -> str:
    """Format a moment as in `2: t = 3.6 s`."""
    return f"{number + 1}: t = {run.time[run.moments[number]]:.1f} s"


def require_matplotlib(command: str) -> None:
    """Raise ResultsError with the command that installs matplotlib if it is missing."""
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise ResultsError(
            f"rearview {command} needs matplotlib, which cannot be imported "
            f"({error}); install it: pip install matplotlib"
        ) from error


def _save(figure: "Figure", target: Path, kind: str) -> None:
    """Write the figure to a temporary file and rename it."""
    try:
        descriptor, name = tempfile.mkstemp(
            prefix=".unfinished-", suffix=f".{kind}", dir=target.parent
        )
        os.close(descriptor)
        aside = Path(name)
        try:
            figure.savefig(aside, format=kind, dpi=RESOLUTION, metadata=_NO_DATE[kind])
            aside.chmod(0o644)
            aside.replace(target)
        finally:
            aside.unlink(missing_ok=True)
    except OSError as error:
        raise ResultsError(
            f"{target}: cannot be written: {error.strerror or error}"
        ) from error
