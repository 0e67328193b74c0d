"""How the scene is set up: the object's place, the table, the light, the noise."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

Colour = tuple[float, float, float]


MotionKind = Literal["none", "conveyor", "turntable", "drift"]


@dataclass(frozen=True)
class TravelParameters:
    """How what the object stands on moves, where ``scene.motion`` lets it; and the robot's pace."""

    speed_m_s: Annotated[
        float | None,
        Field(ge=0, le=0.5, description="Speed of conveyor or drift, m/s; null: 0.1, of a drift 0.03"),
    ] = None
    direction_deg: Annotated[
        float, Field(description="Where conveyor or drift go to, deg from the world's x axis")
    ] = 0.0
    turn_rate_deg_s: Annotated[
        float | None,
        Field(ge=-60, le=60, description="Yaw rate of turntable or drift, deg/s; null: 30, of a drift 8"),
    ] = None
    axis_distance_m: Annotated[
        float, Field(ge=0, le=0.5, description="Distance of the turntable's axis from the object, m")
    ] = 0.05
    variation: Annotated[
        float, Field(ge=0, le=1, description="Share by which a drift's speed and yaw rate swing up and down")
    ] = 0.3
    period_s: Annotated[float, Field(ge=1, le=600, description="Time of one such swing, s")] = 60.0
    image_period_s: Annotated[
        float,
        Field(ge=0.02, le=5, description="Time from one image to the next, the camera's way included, s"),
    ] = 0.4
    planning_time_s: Annotated[
        float, Field(ge=0, le=60, description="Time from the last image to the hand's first move, s")
    ] = 1.0


@dataclass(frozen=True)
class SceneParameters:
    """A table with one object on it, or a folder of images of one."""

    source: Annotated[
        Literal["simulation", "images"],
        Field(description="Where the images come from: the simulated camera, or files"),
    ] = "simulation"
    images_dir: Annotated[
        str | None,
        Field(description="Folder of images and their cameras (own, COLMAP, OpenCV), for source=images"),
    ] = None
    exif_orientation: Annotated[
        Literal["refuse", "honour", "ignore"],
        Field(description="Photographs turned by their EXIF data: refuse, turn, or take as stored"),
    ] = "refuse"

    motion: Annotated[
        MotionKind,
        Field(
            description="What the object stands on: a table at rest, a conveyor, a turntable, or one that "
            "drifts along and turns at a slowly varying pace"
        ),
    ] = "none"
    travel: Annotated[TravelParameters, Field(description="How it moves, if it does")] = field(
        default_factory=TravelParameters
    )

    unseen_shift_mm: Annotated[
        float,
        Field(
            ge=0,
            le=100,
            description="How far the object is shifted after it was seen, where the seed points to, mm",
        ),
    ] = 0.0
    unseen_turn_deg: Annotated[
        float,
        Field(ge=0, le=180, description="How far it is turned about the vertical then, either way, deg"),
    ] = 0.0

    x_m: Annotated[
        float,
        Field(description="Where the object is put, world x, m; one that moves passes there halfway"),
    ] = 0.0
    y_m: Annotated[float, Field(description="Where the object is put, world y, m")] = 0.0
    yaw_deg: Annotated[
        float | None,
        Field(description="Yaw on top of the object's own, deg; null = drawn from the seed"),
    ] = 0.0
    drop_height_m: Annotated[float, Field(ge=0, le=1, description="Height it falls from, m")] = 0.003
    settle_time_s: Annotated[
        float, Field(gt=0, le=60, description="Longest time until it must be at rest, s")
    ] = 8.0
    gravity: Annotated[float, Field(gt=0, description="Gravity, m/s^2")] = 9.81
    table_friction: Annotated[float, Field(ge=0, description="Friction of the table top")] = 0.8

    renderer: Annotated[
        Literal["tiny", "egl", "auto"],
        Field(description="PyBullet's renderer: software, OpenGL by EGL, or EGL if it loads"),
    ] = "tiny"
    full_rendering: Annotated[
        bool,
        Field(description="Let PyBullet render the table too; else only the object, on a computed table"),
    ] = False
    supersampling: Annotated[
        int, Field(ge=1, le=4, description="Rays per pixel and axis on the object; 1 = jagged edges")
    ] = 2

    table: Annotated[str, Field(description="Table top: plain, checker, wood, speckle, or an image file")] = (
        "plain"
    )
    table_rgb: Annotated[
        Colour | None,
        Field(description="Colour of the table top, each 0 to 1; null = the cloth that contrasts most"),
    ] = None
    table_second_rgb: Annotated[
        Colour | None, Field(description="Second colour of its pattern; null = a darker shade of the first")
    ] = None
    table_pattern_m: Annotated[
        float, Field(ge=0.005, le=10, description="Size of the table's pattern, m")
    ] = 0.06
    wall_rgb: Annotated[
        Colour | None,
        Field(description="Colour beyond the table; null = like the table, paler if it has a pattern"),
    ] = None

    light_azimuth_deg: Annotated[float, Field(description="Direction the light comes from, deg")] = 40.0
    light_elevation_deg: Annotated[
        float, Field(gt=5, le=90, description="Height of the light above the horizon, deg")
    ] = 65.0
    ambient: Annotated[float, Field(ge=0, le=1, description="Light from all around")] = 0.55
    diffuse: Annotated[float, Field(ge=0, le=1, description="Light from the lamp")] = 0.45
    specular: Annotated[float, Field(ge=0, le=1, description="Highlights on the object")] = 0.05
    shadow: Annotated[
        float,
        Field(ge=0, le=1, description="Fraction of the lamp's light that the object blocks"),
    ] = 0.6
    shadow_blur_m: Annotated[float, Field(ge=0, le=0.2, description="Width of the shadow's soft edge, m")] = (
        0.008
    )
    light_gradient: Annotated[
        float,
        Field(ge=0, lt=1, description="Brightness drop across the image, fraction"),
    ] = 0.1
    light_gradient_deg: Annotated[
        float, Field(description="Direction of growing brightness in the image, deg from u towards v")
    ] = 30.0

    noise_std: Annotated[float, Field(ge=0, description="Gaussian noise of the sensor, grey levels")] = 1.5
    salt_pepper: Annotated[
        float, Field(ge=0, lt=0.5, description="Fraction of pixels that are stuck at black or white")
    ] = 0.0
    blur_px: Annotated[float, Field(ge=0, le=10, description="Blur of the lens, std, pixels")] = 0.0
