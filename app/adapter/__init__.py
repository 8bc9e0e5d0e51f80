"""Access to viser's private attributes, wrapped in functions, for what viser's public interface does not
offer."""
