"""CommonRoad scenarios and solutions: the files alone, without world or loop."""
