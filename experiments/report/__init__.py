"""Pictures of what a run left; reads run folders, runs nothing."""
