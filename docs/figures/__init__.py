"""Live figures of the site: robots, scenes and lesson steps as data that a browser simulates.

`robot`, `model` and `scene` give the data, `steps` says which steps of lessons are live, `front` builds the
program of docs/browser/ and writes everything beside the built pages."""
