"""The interface between page and simulation: messages, the chosen scene, shared memory and processes."""
