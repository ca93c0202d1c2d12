"""What clouds in tiles need of the service: several replicas, and operations of their own."""
