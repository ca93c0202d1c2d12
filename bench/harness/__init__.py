"""Measures gramian beside its references. `bench/run` starts it."""
