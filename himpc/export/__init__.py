"""Controllers outside Python: the compiled tick as C or WebAssembly, made from the functions that the lab
runs.

`image_of` (in `image`) returns the memory of a controller, `object_code` (in `objects`) the code for a
target, and `files_of` (in `folder`) all files of an export."""
