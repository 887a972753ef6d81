"""Speed planning on the s-T graph; [Thesis] 6.3-6.4."""
