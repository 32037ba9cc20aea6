"""Hostile streams by construction: records with values that no encoder writes, coded anew.

CRCs, numbers, index and totals are right unless one of them is the hostility, so
that the fault lies as deep as it was put.
"""
