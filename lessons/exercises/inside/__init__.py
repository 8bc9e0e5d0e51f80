"""What stands in the process of a submission, and nothing else of the lab: the pipe, `now`, the limits."""
