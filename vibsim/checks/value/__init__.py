"""The check ``value``: a number against its bound."""
