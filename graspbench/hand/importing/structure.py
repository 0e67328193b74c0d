"""What of a URDF is palm and what fingers: the body that branches, and the chains that leave it."""

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass

from graspbench.errors import HandError

_MOVING = ("revolute", "continuous", "prismatic", "planar", "floating")
_WORDS = ("thumb", "index", "middle", "ring", "pinky", "little")


@dataclass(frozen=True)
class FoundFinger:
    """A finger in a URDF.

    Attributes:
        name: A name made of those of its joints or links.
        joints: Joints that move it and nothing else, from palm to tip.
        link: Link behind the last of them.
        frame: A link without shapes that is fixed to it and named as a tip, if there is one.
    """

    name: str
    joints: tuple[str, ...]
    link: str
    frame: str | None


@dataclass(frozen=True)
class Structure:
    """A hand's tree.

    Attributes:
        palm: The palm's link.
        fingers: The fingers, in the order of the file.
        shared: Joints behind the palm that move several fingers.
        wrist: Joints between root and palm.
    """

    palm: str
    fingers: tuple[FoundFinger, ...]
    shared: tuple[str, ...]
    wrist: tuple[str, ...]


class LinkTree:
    """The links of a URDF as a tree, refused where they are none; ``hand`` is the name for messages."""

    def __init__(self, robot: ElementTree.Element, hand: str) -> None:
        self.links = [link.get("name", "") for link in robot.findall("link")]
        self.joints = [joint.get("name", "") for joint in robot.findall("joint")]
        self.parent: dict[str, tuple[str, str]] = {}
        self.children: dict[str, list[str]] = {name: [] for name in self.links}
        self.moving: set[str] = set()
        for kind, names in (("links", self.links), ("joints", self.joints)):
            if len(set(names)) < len(names):
                twice = next(name for name in names if names.count(name) > 1)
                raise HandError(
                    f"hand '{hand}' has two {kind} of the name '{twice}'",
                    remedy="correct the file's tree of links",
                )
        self.shaped = {
            link.get("name", "") for link in robot.findall("link") if link.find("collision") is not None
        }
        for joint in robot.findall("joint"):
            name, ends = joint.get("name", ""), [joint.find(end) for end in ("parent", "child")]
            above, below = ("" if end is None else end.get("link", "") for end in ends)
            for link in (above, below):
                if link not in self.children:
                    raise HandError(
                        f"joint '{name}' of hand '{hand}' names the link '{link}', which is not there",
                        remedy="correct the file's tree of links",
                        joint=name,
                    )
            if below in self.parent:
                raise HandError(
                    f"link '{below}' of hand '{hand}' has two parents, the joints "
                    f"'{self.parent[below][0]}' and '{name}'",
                    remedy="take one of the joints out: the links have to form a tree",
                    link=below,
                )
            self.parent[below] = (name, above)
            self.children[above].append(below)
            if joint.get("type") in _MOVING:
                self.moving.add(name)
        for link in self.links:
            self.way(link, hand)

    def way(self, link: str, hand: str = "") -> list[tuple[str, str]]:
        """Return (joint, link) from below the root to a link."""
        found, seen = [], {link}
        while link in self.parent:
            joint, above = self.parent[link]
            found.append((joint, link))
            link = above
            if link in seen:
                raise HandError(
                    f"the links of hand '{hand}' form a ring at '{link}'",
                    remedy="correct the file's tree",
                    link=link,
                )
            seen.add(link)
        return found[::-1]

    def below(self, link: str) -> list[str]:
        """Return the links below a link, itself included, nearest first."""
        found = [link]
        for each in found:
            found.extend(self.children[each])
        return found


def find_structure(
    robot: ElementTree.Element, hand: str, palm: str | None = None, drop: Sequence[str] = ()
) -> Structure:
    """Find palm and fingers.

    A finger ends at a joint behind which nothing else moves. The palm is the last link that all fingers have
    in common.

    Args:
        robot: The URDF.
        hand: Name of the hand, for error messages.
        palm: The palm's link, if it is known: what does not hang on it counts as arm.
        drop: Names of fingers to leave out.

    Raises:
        HandError: The file is no tree, or has fewer than two fingers.
    """
    tree = LinkTree(robot, hand)
    if palm is not None and palm not in tree.children:
        raise HandError(
            f"hand '{hand}' has no link '{palm}'",
            remedy=f"choose the palm among {', '.join(tree.links)}",
            link=palm,
        )
    within = set(tree.below(palm)) if palm is not None else set(tree.links)
    ends = [
        link
        for link in tree.links
        if link in within
        and link != palm
        and link in tree.parent
        and tree.parent[link][0] in tree.moving
        and not any(tree.parent[below][0] in tree.moving for below in tree.below(link)[1:])
    ]
    ways = [[joint_link for joint_link in tree.way(end)] for end in ends]
    root = next((link for link in tree.links if link not in tree.parent), "")
    if palm is None:
        palm = root
        for step in zip(*ways, strict=False) if len(ways) > 1 else ():
            if len(set(step)) > 1:
                break
            palm = step[0][1]
    depth = len(tree.way(palm))
    chains = [[(j, link) for j, link in way[depth:] if j in tree.moving] for way in ways]
    counts: dict[str, int] = {}
    for chain in chains:
        for joint, _ in chain:
            counts[joint] = counts.get(joint, 0) + 1
    shared = tuple(joint for joint, count in counts.items() if count > 1)
    own = [[(j, link) for j, link in chain if counts[j] == 1] for chain in chains]
    names = _names(own)
    unknown = [name for name in drop if name not in names]
    if unknown:
        raise HandError(
            f"hand '{hand}' has no finger '{unknown[0]}' to drop", remedy=f"choose among {', '.join(names)}"
        )
    fingers = tuple(
        FoundFinger(name, tuple(j for j, _ in chain), chain[-1][1], _tip_frame(tree, chain[-1][1]))
        for name, chain in zip(names, own, strict=True)
        if name not in drop
    )
    if len(fingers) < 2:
        raise HandError(
            f"hand '{hand}' has {len(fingers)} finger(s) below '{palm}': "
            + ("nothing moves there" if not fingers else f"only '{fingers[0].link}' ends a chain of joints"),
            remedy="take a file of a hand with two fingers or more, or name the palm's link with --palm",
            palm=palm,
        )
    wrist = tuple(joint for joint, _ in tree.way(palm) if joint in tree.moving)
    return Structure(palm, fingers, shared, wrist)


def _tip_frame(tree: LinkTree, link: str) -> str | None:
    bare = [name for name in tree.below(link)[1:] if name not in tree.shaped and not tree.children[name]]
    named = [name for name in bare if re.search("tip|head|end", name, re.IGNORECASE)]
    return named[0] if named else None


def _names(chains: Sequence[Sequence[tuple[str, str]]]) -> list[str]:
    """Return short names that tell the fingers apart."""
    guesses, by_word = [], []
    for chain in chains:
        text = " ".join(f"{joint} {link}" for joint, link in chain).lower()
        words = [word for word in _WORDS if word in text]
        by_word.append(words[0] if len(words) == 1 else "")
        joints = [joint for joint, _ in chain]
        common = joints[0]
        for joint in joints[1:]:
            while not joint.startswith(common):
                common = common[:-1]
        if len(joints) == 1:
            common = chain[0][1]
        plain = re.sub(r"^(joint|link)[_-]|[_.-]*(joint|link)?[_.-]*$", "", common, flags=re.IGNORECASE)
        guesses.append(re.sub(r"\W", "_", plain))
    for names in (by_word, guesses):
        if len(set(names)) == len(names) and all(names):
            return names
    return [f"finger_{i + 1}" for i in range(len(chains))]
