"""What a finished run leaves behind, one file per kind of output."""
