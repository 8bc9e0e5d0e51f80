"""Functions that use viser's private attributes, where viser's public interface lacks a function."""
