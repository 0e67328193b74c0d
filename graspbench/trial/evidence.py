"""What a trial has seen: light, so that whoever draws it need not load the stages."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from graspbench.perception import Silhouette, View
    from graspbench.reconstruction import Surface


@dataclass
class Evidence:
    """What a trial has come to so far, for a look at one that failed on its way.

    Attributes:
        views: The images.
        silhouettes: Their silhouettes.
        surfaces: The reconstruction's snapshots.
    """

    views: "tuple[View, ...]" = ()
    silhouettes: "tuple[Silhouette, ...]" = ()
    surfaces: "list[Surface]" = field(default_factory=list)
