"""Results of a sweep as a table, statistics and comparisons of planners."""
