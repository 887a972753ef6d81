"""The one error of the sumo_nets package."""


class NetworkError(Exception):
    """A network, a route through it or a demand on it holds something not allowed."""
