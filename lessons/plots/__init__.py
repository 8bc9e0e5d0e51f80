"""Pictures for print and page, described as data (`panels`). Only this package imports matplotlib."""
