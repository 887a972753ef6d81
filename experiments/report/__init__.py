"""Pages, figures and films of run folders; runs nothing."""
