"""The code of the lab that runs in the process of a submission: the pipe, `now`, the limits."""
