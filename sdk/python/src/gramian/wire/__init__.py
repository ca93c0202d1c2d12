"""How requests and answers travel: HTTP, arrays as tensors, jobs, and problems."""
