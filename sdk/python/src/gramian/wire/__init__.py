"""Transport of requests and answers: HTTP, arrays as tensors, jobs, and problems."""
