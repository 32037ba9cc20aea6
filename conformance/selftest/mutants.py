"""The list of all mutants."""

import anchor_mutants
import coding_mutants
import container_mutants
import snapshot_mutants
import state_mutants
import update_mutants
from mutant import Mutant

MUTANTS: tuple[Mutant, ...] = (
    *container_mutants.MUTANTS,
    *coding_mutants.MUTANTS,
    *state_mutants.MUTANTS,
    *anchor_mutants.MUTANTS,
    *update_mutants.MUTANTS,
    *snapshot_mutants.MUTANTS,
)
