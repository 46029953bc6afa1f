"""Task families, their rewards, and how tasks are drawn. Nothing here knows a body."""

from rebody.tasks.catalogue import SHIPPED
from rebody.tasks.family import Direction, Family
from rebody.tasks.family_set import FamilySet
from rebody.tasks.laws import LAWS, RewardLaw
from rebody.tasks.payment import Payment
from rebody.tasks.quantities import Quantity

__all__ = ["LAWS", "SHIPPED", "Direction", "Family", "FamilySet", "Payment", "Quantity", "RewardLaw"]
