"""Pictures of bodies in space without PyVista: each pixel shows the nearest of the spheres and triangles on its line of sight."""

import numpy as np

EYE = np.array([1.0, -1.6, 0.8])  # the direction that bodies are looked at from
LIGHT = np.array([0.35, -0.6, 0.9])


class Canvas:
    """Image (height, width, 3) in [0, 1] with a depth buffer and the body shown by each pixel, -1 for none."""

    def __init__(self, window, low, high):
        width, height = window
        self.image, self.depth = np.ones((height, width, 3)), np.full((height, width), -np.inf)
        self.body = np.full((height, width), -1, np.int64)
        extent = np.maximum(high - low, np.finfo(float).tiny)
        self.scale = 0.92 * min(width / extent[0], height / extent[1])  # pixels in a metre
        self.origin = np.array([width, height]) / 2 - self.scale * (low + high) / 2

    def pixels(self, x):
        """Positions in pixels from the lower left corner of points (..., 2) on the plane of the picture."""
        return self.origin + self.scale * x

    def window_of(self, low, high):
        """Rows and columns (slices) of a box of pixels, and the middles of these pixels: (1, w) across, (h, 1) up."""
        height, width = self.depth.shape
        x0, y0 = np.maximum(np.floor(low).astype(int), 0)
        x1, y1 = np.minimum(np.ceil(high).astype(int) + 1, (width, height))
        return (slice(y0, y1), slice(x0, x1)), np.arange(x0, x1)[None, :] + 0.5, np.arange(y0, y1)[:, None] + 0.5

    def put(self, window, inside, depth, body, colour):
        """Colours the pixels of a window that are inside and pass the depth test."""
        nearer = inside & (depth > self.depth[window])
        self.depth[window][nearer] = depth[nearer]
        self.body[window][nearer] = body
        self.image[window][nearer] = colour[nearer] if colour.ndim == 3 else colour

    def outlined(self):
        """The image with the rims of bodies darkened, its first row on top as images have it, in numbers of 8 bits."""
        rim = np.zeros(self.body.shape, bool)
        rim[:, 1:] |= self.body[:, 1:] != self.body[:, :-1]
        rim[1:] |= self.body[1:] != self.body[:-1]
        image = np.where((rim & (self.body >= 0))[..., None], 0.55 * self.image, self.image)
        return np.uint8(np.round(255 * image[::-1]))


def render(center, radius, values, palette, limits, window, mesh=None, of_bodies=None):
    """An image (height, width, 3) of spheres, and of the mesh of other bodies as meshes_of gives it, coloured by their values."""
    from matplotlib.colors import Normalize

    eye = EYE / np.linalg.norm(EYE)
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(eye, right), eye])  # rows: to the right, up, towards the eye
    points, triangles, rows = (np.zeros((0, 3)), np.zeros((0, 3), int), np.zeros(0, int)) if mesh is None else mesh
    balls, corners = np.asarray(center, float).reshape(-1, 3) @ axes.T, points @ axes.T
    ends = np.concatenate([balls[:, :2] - radius[:, None], balls[:, :2] + radius[:, None], corners[:, :2]])
    canvas = Canvas(window, *((ends.min(0), ends.max(0)) if len(ends) else (np.zeros(2), np.ones(2))))
    paint, light = Normalize(*limits), axes @ (LIGHT / np.linalg.norm(LIGHT))
    if len(triangles):
        colours = palette(paint(np.asarray(of_bodies, float)))[:, :3]
        _draw_triangles(canvas, corners, triangles, rows, colours, light)
    if len(balls):
        first = 1 + (int(rows.max()) if len(rows) else 0)
        _draw_balls(canvas, balls, radius, palette(paint(np.asarray(values, float)))[:, :3], first, light)
    return canvas.outlined()


def _shade(cosine):
    return 0.45 + 0.55 * cosine


def _draw_triangles(canvas, corners, triangles, rows, colours, light):
    x = corners[triangles]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    size = np.linalg.norm(normal, axis=1)
    shown = np.flatnonzero(np.abs(normal[:, 2]) > 1e-12 * size)  # the others are seen edge on
    flat, depth = canvas.pixels(x[..., :2]), x[..., 2]
    shades = _shade(np.abs(normal @ light) / np.maximum(size, np.finfo(float).tiny))
    for k in shown:
        (ax, ay), (bx, by), (cx, cy) = flat[k]
        window, px, py = canvas.window_of(flat[k].min(0), flat[k].max(0))
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        b = ((px - ax) * (cy - ay) - (py - ay) * (cx - ax)) / area
        c = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / area
        inside = (b >= 0) & (c >= 0) & (b + c <= 1)
        at = depth[k, 0] + b * (depth[k, 1] - depth[k, 0]) + c * (depth[k, 2] - depth[k, 0])
        canvas.put(window, inside, at, rows[k], shades[k] * colours[rows[k]])


def _draw_balls(canvas, centers, radii, colours, first, light):
    flat, size = canvas.pixels(centers[:, :2]), canvas.scale * radii
    for k in range(len(centers)):
        window, px, py = canvas.window_of(flat[k] - size[k], flat[k] + size[k])
        u, v = (px - flat[k, 0]) / size[k], (py - flat[k, 1]) / size[k]
        w2 = 1 - u**2 - v**2
        w = np.sqrt(np.maximum(w2, 0))
        shade = _shade(np.maximum(u * light[0] + v * light[1] + w * light[2], 0))
        canvas.put(window, w2 >= 0, centers[k, 2] + radii[k] * w, first + k, shade[..., None] * colours[k])
