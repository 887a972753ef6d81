// The page's colours, light or dark, for what is drawn on canvases.

function theme() {
  const style = getComputedStyle(document.documentElement);
  const names = [
    "asphalt", "marking", "kerb", "edge", "reference", "obstacle", "vehicle",
    "vehicle-line", "ego", "plan", "blocker", "ghost", "text", "muted", "surface",
    "ground", "grid", "line", "second", "limit", "kept", "red", "amber", "green", "indicator",
    "removed-0", "removed-1", "removed-2", "removed-3", "removed-4", "removed-5",
    "series-0", "series-1", "series-2", "series-3", "series-4", "series-5", "accent",
  ];
  return Object.fromEntries(
    names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]),
  );
}
