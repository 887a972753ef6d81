"""What each planner of `hostile_planner` must become: status, failure, reason."""

ARRIVED = ("arrived", None, "arrived at t = ")


def failed(words: str) -> tuple[str, None, str]:
    return "planner_failed", None, words


def died(words: str) -> tuple[str, str, str]:
    return "crashed", "process_died", f"the process of the episode {words}"


LATE = ("crashed", "wall_clock", "exceeded 20 s of wall clock")
TOO_LARGE = ("crashed", "memory", "exceeded 900 MB of memory")

OUTCOMES: dict[str, tuple[str, str | None, str]] = {
    "exit_0": died("left with exit status 0 before the end"),
    "exit_7": died("left with exit status 7 before the end"),
    "segfault": died("died of SIGSEGV"),
    "abort": died("died of SIGABRT"),
    "kill_itself": died("died of SIGKILL"),
    "terminate_itself": died("died of SIGTERM"),
    "interrupt_itself": ARRIVED,
    "alarm": died("died of SIGALRM"),
    "hang": LATE,
    "hang_deaf": LATE,
    "raise": failed("RuntimeError: no idea"),
    "raise_mute": failed("MuteError: (its text raises MuteError)"),
    "raise_own": failed("OwnError: mine"),
    "cancelled": failed("CancelledError"),
    "keyboard": failed("KeyboardInterrupt"),
    "system_exit": failed("SystemExit: bye"),
    "generator_exit": failed("GeneratorExit"),
    "stop_iteration": failed("StopIteration"),
    "long_text": failed("ValueError: x x x"),
    "group": failed("BaseExceptionGroup: all (2 sub-exceptions)"),
    "recursion": failed("RecursionError"),
    "memory": TOO_LARGE,
    "memory_in_children": TOO_LARGE,
    "huge_array": failed("MemoryError"),
    "huge_plan": failed("allowed: up to 100000 points"),
    "nan_plan": failed("numbers that are not finite"),
    "backward_plan": failed("allowed: 0 or more"),
    "jump": failed("starts 50.00 m from the ego"),
    "none": failed("plan() is object"),
    "generator": failed("plan() is generator"),
    "text_stats": failed("stats.candidates is str 'many'"),
    "hollow": failed("what plan() returned raises AttributeError"),
    "write_road": failed("changed scene.path; allowed: reading"),
    "write_vehicles": failed("ValueError: cannot set WRITEABLE flag"),
    "without_numpy": ("crashed", "error", "ZeroDivisionError"),  # in our own code
    "alternatives": ARRIVED,
    "threads": ARRIVED,
    "atexit_hang": ARRIVED,
    "flood": ARRIVED,
    "forked_copy": ARRIVED,
    "children": ARRIVED,
    "daemons": ARRIVED,
    "shell": ARRIVED,
    "many_processes": ("crashed", "processes", "processes"),
    "daemons_then_crash": died("died of SIGSEGV"),
    "close_pipes": died("left with exit status 1"),
}
