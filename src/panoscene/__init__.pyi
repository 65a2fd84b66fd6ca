from panoscene.pipeline import load as load

__version__: str
