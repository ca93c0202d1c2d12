"""Access to the service for tiled clouds: several replicas, and operations that only tiles need."""
