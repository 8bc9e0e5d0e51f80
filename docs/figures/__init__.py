"""Live figures of the site: robots, scenes and lesson steps as data that a browser simulates.

`robot`, `model` and `scene` produce the data. `steps` selects the steps of lessons that run in a browser.
`front` builds the program of docs/browser/ and writes all files beside the built pages."""
