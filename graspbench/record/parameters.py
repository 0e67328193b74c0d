"""What the user may say about the record of a trial."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

Level = Literal["off", "scores", "full"]


@dataclass(frozen=True)
class RecordParameters:
    """How much of a trial is kept."""

    level: Annotated[
        Level,
        Field(description="off: no log; scores: messages and scores; full: images, geometry, motion too"),
    ] = "full"
    image_format: Annotated[
        Literal["jpeg", "png"], Field(description="Compression of the camera images; masks are always PNG")
    ] = "jpeg"
    jpeg_quality: Annotated[int, Field(ge=10, le=100, description="JPEG quality")] = 90
    surface_every: Annotated[
        int, Field(ge=1, description="Keep every n-th surface snapshot; the first and the last always")
    ] = 2
    pictures: Annotated[bool, Field(description="Draw the trial's pictures (PNG) too")] = True
    video: Annotated[
        bool, Field(description="Film the execution too: execution.mp4, which the report's page plays")
    ] = False
    print: Annotated[
        bool, Field(description="Draw them for print: 300 dots an inch, PDF and SVG beside PNG")
    ] = False
    host: Annotated[bool, Field(description="Name the machine in the result")] = False
    titles: Annotated[bool, Field(description="Write a title and the measures into the pictures")] = False
