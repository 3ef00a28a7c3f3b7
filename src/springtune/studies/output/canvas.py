"""A figure as PNG and as PDF by one pass over it: most of the time of drawing is texts, ticks and layout."""

import io
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any, ClassVar, Literal, cast

import matplotlib
import numpy as np
from matplotlib.backend_bases import GraphicsContextBase, RendererBase
from matplotlib.backends import _backend_pdf_ps
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.backends.backend_pdf import PdfFile, RendererPdf
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, get_font
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Affine2D, Affine2DBase, Transform, TransformedBbox, TransformedPath
from matplotlib.typing import ColorType
from numpy.typing import ArrayLike
from PIL import Image

from .style import POINTS, SETTINGS

COMPRESSION = 1
"""Level of the PNG's compression: higher ones take twice the time for a tenth of the size."""


def png_and_pdf(figure: Figure) -> dict[str, bytes]:
    """A figure in both formats. Without dates in them the same figure gives the same files."""
    with matplotlib.rc_context(SETTINGS):
        width, height = figure.get_size_inches()
        dpi = matplotlib.rcParams["savefig.dpi"]
        figure.dpi = POINTS
        content = io.BytesIO()
        file = PdfFile(content, metadata={"CreationDate": None})
        try:
            file.newPage(width, height)
            page = RendererPdf(file, dpi, height, width)
            pixels = RendererAgg(width * dpi, height * dpi, dpi)
            figure.draw(_Both(page, pixels))
            page.finalize()
            with _fonts_cut_once():
                file.finalize()
        finally:
            file.close()
        picture = io.BytesIO()
        image = Image.fromarray(np.asarray(pixels.buffer_rgba())).convert("RGB")
        image.save(picture, "png", dpi=(dpi, dpi), compress_level=COMPRESSION)
        return {"png": picture.getvalue(), "pdf": content.getvalue()}


# -- fonts -------------------------------------------------------------------------------------------------------------

CHARACTERS = frozenset(map(chr, range(32, 127))) | set(
    "αβγδεζηθκλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ√·×±−–—≤≥≈≠∞∂°²³¹⁰⁴⁵⁶⁷⁸⁹⁻µₐₘₓ’\u00a0"
)
"""Characters that a font is cut to, whichever of them a figure has."""


class _Saved:
    """A font that was cut before, as matplotlib asks one for its file."""

    def __init__(self, content: bytes) -> None:
        self.content = content

    def save(self, file: io.BytesIO, **_: object) -> None:
        file.write(self.content)


@cache
def _cut(path: Any, glyphs: frozenset[int]) -> tuple[_Saved, dict[int, int]]:
    with _ORIGINAL(path, set(glyphs)) as found:
        return _Saved(_backend_pdf_ps.font_as_file(found.font).getvalue()), dict(found.glyph_index_map)


@cache
def _usual(path: Any) -> frozenset[int]:
    """Glyphs of `CHARACTERS` in a font."""
    font = get_font(path)
    return frozenset(font.get_char_index(ord(character)) for character in CHARACTERS)


@contextmanager
def _shared(path: Any, glyphs: Iterable[int]) -> Iterator[Any]:
    """In place of matplotlib's own, which cuts the font again for each figure: half of a figure's time.

    Ligatures come as a font of their own.
    """
    wanted = frozenset(glyphs)
    yield _backend_pdf_ps.SubsetResults(*_cut(path, _usual(path) if wanted <= _usual(path) else wanted))


_ORIGINAL: Any = _backend_pdf_ps.get_glyphs_subset


@contextmanager
def _fonts_cut_once() -> Iterator[None]:
    """Fonts in files that are finished inside are cut once a process; matplotlib has no other way to say so.

    Where a matplotlib cuts in another way it goes on to do so, and is slower.
    """
    if not hasattr(_backend_pdf_ps, "SubsetResults"):
        yield
        return
    backend: Any = _backend_pdf_ps
    backend.get_glyphs_subset = _shared
    try:
        yield
    finally:
        backend.get_glyphs_subset = _ORIGINAL


# -- both formats ------------------------------------------------------------------------------------------------------


class _Both(RendererBase):
    """Draws on a page and in pixels; what it is asked about lengths is answered for the page.

    Artists that ask to be rasterized stay vectors on the page.
    """

    sizes: ClassVar[dict[tuple[str, int, bool | Literal["TeX"]], tuple[float, float, float]]] = {}
    """Width, height and descent of texts [pt], which many figures share."""

    def __init__(self, page: RendererPdf, pixels: RendererAgg) -> None:
        super().__init__()
        self.page, self.pixels = page, pixels
        self.scale = pixels.dpi / POINTS
        self.enlarged = Affine2D().scale(self.scale)

    def draw_path(
        self, gc: GraphicsContextBase, path: Path, transform: Transform, rgbFace: ColorType | None = None
    ) -> None:
        self.page.draw_path(gc, path, transform, rgbFace)
        self.pixels.draw_path(self._large(gc), path, transform + self.enlarged, rgbFace)

    def draw_markers(
        self,
        gc: GraphicsContextBase,
        marker_path: Path,
        marker_trans: Transform,
        path: Path,
        trans: Transform,
        rgbFace: ColorType | None = None,
    ) -> None:
        self.page.draw_markers(gc, marker_path, marker_trans, path, trans, rgbFace)
        self.pixels.draw_markers(
            self._large(gc), marker_path, marker_trans + self.enlarged, path, trans + self.enlarged, rgbFace
        )

    # What is handed on as it is depends on the version of matplotlib.
    def draw_path_collection(
        self,
        gc: GraphicsContextBase,
        master_transform: Transform,
        paths: Sequence[Path],
        all_transforms: Sequence[ArrayLike],
        offsets: ArrayLike | Sequence[ArrayLike],
        offset_trans: Transform,
        *rest: Any,
        **more: Any,
    ) -> None:
        self.page.draw_path_collection(
            gc, master_transform, paths, all_transforms, offsets, offset_trans, *rest, **more
        )
        self.pixels.draw_path_collection(
            self._large(gc), self._frozen(master_transform), paths, all_transforms, offsets,
            self._frozen(offset_trans), *rest, **more,
        )  # fmt: skip

    def draw_quad_mesh(
        self,
        gc: GraphicsContextBase,
        master_transform: Transform,
        meshWidth: int,
        meshHeight: int,
        coordinates: ArrayLike,
        offsets: ArrayLike | Sequence[ArrayLike],
        offsetTrans: Transform,
        *rest: Any,
        **more: Any,
    ) -> None:
        self.page.draw_quad_mesh(
            gc, master_transform, meshWidth, meshHeight, coordinates, offsets, offsetTrans, *rest, **more
        )
        self.pixels.draw_quad_mesh(
            self._large(gc), self._frozen(master_transform), meshWidth, meshHeight, coordinates, offsets,
            self._frozen(offsetTrans), *rest, **more,
        )  # fmt: skip

    def draw_image(
        self, gc: GraphicsContextBase, x: float, y: float, im: ArrayLike, transform: Affine2DBase | None = None
    ) -> None:
        # Made for as many pixels as there are.
        self.page.draw_image(gc, x, y, im, transform)
        self.pixels.draw_image(self._large(gc), round(self.scale * x), round(self.scale * y), im)

    def draw_text(
        self,
        gc: GraphicsContextBase,
        x: float,
        y: float,
        s: str,
        prop: FontProperties,
        angle: float,
        ismath: bool | Literal["TeX"] = False,
        mtext: Text | None = None,
    ) -> None:
        self.page.draw_text(gc, x, y, s, prop, angle, ismath, mtext)
        height = self.pixels.height - self.scale * y
        self.pixels.draw_text(self._large(gc), self.scale * x, height, s, prop, angle, ismath, mtext)

    def get_text_width_height_descent(
        self, s: str, prop: FontProperties, ismath: bool | Literal["TeX"]
    ) -> tuple[float, float, float]:
        key = (s, hash(prop), ismath)
        if key not in self.sizes:
            self.sizes[key] = self.page.get_text_width_height_descent(s, prop, ismath)
        return self.sizes[key]

    def _frozen(self, transform: Transform) -> Transform:
        """A transform to pixels, as it is now."""
        return cast(Transform, (transform + self.enlarged).frozen())

    def _large(self, gc: GraphicsContextBase) -> GraphicsContextBase:
        """Where and how to draw, in pixels."""
        large = GraphicsContextBase()
        large.copy_properties(gc)
        box, (path, transform) = gc.get_clip_rectangle(), gc.get_clip_path()
        if box is not None:
            large.set_clip_rectangle(TransformedBbox(box, self.enlarged))  # type: ignore[arg-type]  # any box serves
        if path is not None and transform is not None:
            clip = TransformedPath(path, transform + self.enlarged)  # type: ignore[arg-type]  # it is a plain Path
            large.set_clip_path(clip)
        return large

    def new_gc(self) -> GraphicsContextBase:
        return self.page.new_gc()

    def flipy(self) -> bool:
        return False

    def get_canvas_width_height(self) -> tuple[float, float]:
        return self.page.get_canvas_width_height()

    def points_to_pixels(self, points: ArrayLike) -> ArrayLike:
        return points

    def get_image_magnification(self) -> float:
        return self.page.get_image_magnification()

    def option_image_nocomposite(self) -> bool:
        return self.page.option_image_nocomposite()
