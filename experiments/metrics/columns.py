"""Names of the columns of the results row, in their order."""

from typing import Final

SCENARIO: Final = "scenario"
PLANNER: Final = "planner"
SEED: Final = "seed"
STATUS: Final = "status"
ARRIVED: Final = "arrived"
COLLISIONS: Final = "collisions"
FIRST_COLLISION_WITH: Final = "first_collision_with"
MIN_CLEARANCE: Final = "min_clearance_m"
MIN_TTC: Final = "min_ttc_s"
MIN_TIME_HEADWAY: Final = "min_time_headway_s"
OFF_ROAD_STEPS: Final = "off_road_steps"
TRAVEL_TIME: Final = "travel_time_s"
DISTANCE: Final = "distance_m"
MEAN_SPEED: Final = "mean_speed_mps"
MEAN_J_JERK: Final = "mean_j_jerk"
MEAN_J_OFFSET: Final = "mean_j_offset_m2"
RMS_JERK: Final = "rms_jerk_mps3"
MAX_ACCELERATION: Final = "max_abs_acceleration_mps2"
MAX_LATERAL_ACCELERATION: Final = "max_abs_lateral_acceleration_mps2"
MAX_CURVATURE: Final = "max_abs_curvature_1pm"
MAX_HEADING: Final = "max_heading_rad"
FALLBACK_CYCLES: Final = "fallback_cycles"
CANDIDATES_MEAN: Final = "candidates_mean"
SURVIVORS_MEAN: Final = "survivors_mean"
PLANNING_P50: Final = "planning_ms_p50"
PLANNING_P95: Final = "planning_ms_p95"
PLANNING_P99: Final = "planning_ms_p99"
PLANNING_MAX: Final = "planning_ms_max"
DEADLINE_MISSES: Final = "deadline_misses"
STEPS_PER_SECOND: Final = "steps_per_s"
REAR_MAX_DECELERATION: Final = "rear_max_deceleration_mps2"
REAR_SPEED_LOSS: Final = "rear_speed_loss_mps"
LANE_CHANGE_TIME: Final = "lane_change_s"
LANE_CHANGE_DONE: Final = "lane_change_done_s"
BEFORE_BLOCKAGE: Final = "changed_before_blockage"
BEHIND_COMPARED: Final = "behind_compared"
BEHIND_DELAY_MEAN: Final = "behind_delay_mean_s"
BEHIND_DELAY_MAX: Final = "behind_delay_max_s"
BEHIND_SPEED_LOSS: Final = "behind_speed_loss_mps"
BEHIND_DECELERATION: Final = "behind_added_deceleration_mps2"

# Wall-clock columns: left out of every comparison of results.
TIMING_COLUMNS: Final = (
    PLANNING_P50,
    PLANNING_P95,
    PLANNING_P99,
    PLANNING_MAX,
    DEADLINE_MISSES,
    STEPS_PER_SECOND,
)

# Every column above, in its order.
ALL_COLUMNS: Final = tuple(
    value
    for name, value in tuple(globals().items())
    if name.isupper() and isinstance(value, str)
)
