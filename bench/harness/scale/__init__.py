"""What `bench/scale` measures: scans and clouds of up to a million points, beside the peers, each in a process of its own."""
