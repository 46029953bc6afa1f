"""Families that come with the package, whose names are taken."""

from rebody.tasks.family_set import FamilySet
from rebody.tasks.line import LINE
from rebody.tasks.plane import PLANE

SHIPPED = FamilySet((*LINE, *PLANE))
"""What a name means where no module and no file says otherwise."""
