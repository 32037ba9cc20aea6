"""quarc-ref: the reference encoder, decoder and format of `.quarc` streams.

Nothing is imported here: `quarc_ref.decoder` decodes without torch,
`quarc_ref.encoder` brings it.
"""

__version__ = "0.1.0"
