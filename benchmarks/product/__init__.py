"""What users meet first: files, pages, pictures, waiting times."""
