"""A figure as PNG and as PDF by one pass over it: most of the time of drawing is texts, ticks and layout."""

import io
from typing import ClassVar

import matplotlib
import numpy as np
from matplotlib.backend_bases import GraphicsContextBase, RendererBase
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.backends.backend_pdf import PdfFile, RendererPdf
from matplotlib.transforms import Affine2D, TransformedBbox, TransformedPath
from PIL import Image

from .style import SETTINGS

POINTS = 72
"""Units of a PDF page in an inch."""


def png_and_pdf(figure):
    """A figure in both formats. Without dates in them the same figure gives the same files.

    Parameters
    ----------
    figure : matplotlib.figure.Figure

    Returns
    -------
    dict of str to bytes
        Content of the file by its ending.
    """
    with matplotlib.rc_context(SETTINGS):
        size = figure.get_size_inches()
        dpi = matplotlib.rcParams["savefig.dpi"]
        figure.dpi = POINTS
        content = io.BytesIO()
        file = PdfFile(content, metadata={"CreationDate": None})
        try:
            file.newPage(*size)
            page = RendererPdf(file, dpi, size[1], size[0])
            pixels = RendererAgg(*(size * dpi), dpi)
            figure.draw(_Both(page, pixels))
            page.finalize()
            file.finalize()
        finally:
            file.close()
        picture = io.BytesIO()
        image = Image.fromarray(np.asarray(pixels.buffer_rgba())).convert("RGB")
        image.save(picture, "png", dpi=(dpi, dpi), compress_level=3)
        return {"png": picture.getvalue(), "pdf": content.getvalue()}


class _Both(RendererBase):
    """Draws on a page and in pixels; what it is asked about lengths is answered for the page.

    Artists that ask to be rasterized stay vectors on the page.
    """

    sizes: ClassVar[dict] = {}
    """Width, height and descent of texts [pt], which many figures share."""

    def __init__(self, page, pixels):
        super().__init__()
        self.page, self.pixels = page, pixels
        self.scale = pixels.dpi / POINTS
        self.enlarged = Affine2D().scale(self.scale)

    def draw_path(self, gc, path, transform, rgbFace=None):
        self.page.draw_path(gc, path, transform, rgbFace)
        self.pixels.draw_path(self._large(gc), path, transform + self.enlarged, rgbFace)

    def draw_markers(self, gc, marker_path, marker_trans, path, trans, rgbFace=None):
        self.page.draw_markers(gc, marker_path, marker_trans, path, trans, rgbFace)
        self.pixels.draw_markers(
            self._large(gc), marker_path, marker_trans + self.enlarged, path, trans + self.enlarged, rgbFace
        )

    def draw_path_collection(self, gc, master_transform, paths, all_transforms, offsets, offset_trans, *rest, **more):
        self.page.draw_path_collection(
            gc, master_transform, paths, all_transforms, offsets, offset_trans, *rest, **more
        )
        self.pixels.draw_path_collection(
            self._large(gc), (master_transform + self.enlarged).frozen(), paths, all_transforms, offsets,
            (offset_trans + self.enlarged).frozen(), *rest, **more,
        )  # fmt: skip

    def draw_quad_mesh(self, gc, master_transform, width, height, coordinates, offsets, offsetTrans, *rest, **more):
        self.page.draw_quad_mesh(gc, master_transform, width, height, coordinates, offsets, offsetTrans, *rest, **more)
        self.pixels.draw_quad_mesh(
            self._large(gc), (master_transform + self.enlarged).frozen(), width, height, coordinates, offsets,
            (offsetTrans + self.enlarged).frozen(), *rest, **more,
        )  # fmt: skip

    def draw_image(self, gc, x, y, im, transform=None):
        # Made for as many pixels as there are.
        self.page.draw_image(gc, x, y, im, transform)
        self.pixels.draw_image(self._large(gc), round(self.scale * x), round(self.scale * y), im)

    def draw_text(self, gc, x, y, s, prop, angle, ismath=False, mtext=None):
        self.page.draw_text(gc, x, y, s, prop, angle, ismath, mtext)
        height = self.pixels.height - self.scale * y
        self.pixels.draw_text(self._large(gc), self.scale * x, height, s, prop, angle, ismath, mtext)

    def get_text_width_height_descent(self, s, prop, ismath):
        key = (s, hash(prop), ismath)
        if key not in self.sizes:
            self.sizes[key] = self.page.get_text_width_height_descent(s, prop, ismath)
        return self.sizes[key]

    def _large(self, gc):
        """Where and how to draw, in pixels."""
        large = GraphicsContextBase()
        large.copy_properties(gc)
        box, (path, transform) = gc.get_clip_rectangle(), gc.get_clip_path()
        if box is not None:
            large.set_clip_rectangle(TransformedBbox(box, self.enlarged))
        if path is not None:
            large.set_clip_path(TransformedPath(path, transform + self.enlarged))
        return large

    def new_gc(self):
        return self.page.new_gc()

    def flipy(self):
        return False

    def get_canvas_width_height(self):
        return self.page.get_canvas_width_height()

    def points_to_pixels(self, points):
        return points

    def get_image_magnification(self):
        return self.page.get_image_magnification()

    def option_image_nocomposite(self):
        return self.page.option_image_nocomposite()
