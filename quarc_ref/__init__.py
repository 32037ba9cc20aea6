"""quarc-ref: the reference encoder, decoder and format of `.quarc` streams.

Nothing is imported here, so that `quarc_ref.decoder` can be used without torch, which
`quarc_ref.encoder` imports.
"""

__version__ = "0.2.0.dev0"
