"""Pictures read and written (OpenImageIO), and how far apart two of them are."""

import numpy as np


def read_picture(path):
    """Red, green and blue of an EXR, row 0 at the top, whatever layer they are in."""
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(path)
    if source is None:
        raise OSError(f"{path}: {oiio.geterror()}")
    names = list(source.spec().channelnames)
    values = source.read_image(oiio.FLOAT)
    source.close()

    def channel(letter):
        for index, name in enumerate(names):
            if name == letter or (name.endswith("." + letter) and "Combined" in name):
                return index
        raise ValueError(f"{path}: no channel {letter}")

    return np.ascontiguousarray(values[:, :, [channel(letter) for letter in "RGB"]], np.float32)


def write_picture(path, values, kind="half"):
    import OpenImageIO as oiio

    height, width, channels = values.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    spec.attribute("compression", "zip")
    target = oiio.ImageOutput.create(path)
    target.open(path, spec)
    target.write_image(np.ascontiguousarray(values, np.float32))
    target.close()


def write_side_by_side(path, pictures):
    """An 8-bit sRGB picture of linear ones in a row, to look at."""
    import OpenImageIO as oiio

    row = np.clip(np.concatenate(pictures, axis=1), 0, 1)
    encoded = np.where(row <= 0.0031308, 12.92 * row, 1.055 * row ** (1 / 2.4) - 0.055)
    codes = np.ascontiguousarray(np.round(255 * encoded), np.uint8)
    target = oiio.ImageOutput.create(path)
    target.open(path, oiio.ImageSpec(codes.shape[1], codes.shape[0], 3, "uint8"))
    target.write_image(codes)
    target.close()


def read_texture(path, color_space):
    """Linear texels; an integer file declared sRGB is decoded by IEC 61966-2-1."""
    import OpenImageIO as oiio

    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(path, config)
    if source is None:
        raise OSError(f"{path}: {oiio.geterror()}")
    is_float = source.spec().format.basetype in (oiio.HALF, oiio.FLOAT)
    names = list(source.spec().channelnames)
    values = source.read_image(oiio.FLOAT)
    source.close()
    if is_float and all(letter in names for letter in "RGB"):
        values = values[:, :, [names.index(letter) for letter in "RGB"]]
    elif values.shape[2] < 3:
        values = values[:, :, [0, 0, 0]]
    values = values[:, :, :3].astype(np.float64)
    if color_space == "srgb" and not is_float:
        values = np.where(
            values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4
        )
    return values


class Reference:
    """What pictures are measured against: two independent converged ones, or one of known noise.

    With two, a and b, of mean m, the mean of (x-a)(x-b)/(m^2+1e-2) is free of their noise; with
    one, the noise's own relMSE is taken off.
    """

    def __init__(self, pictures, noise=0.0, source=""):
        self.pictures = [picture.astype(np.float64) for picture in pictures]
        self.mean = sum(self.pictures) / len(self.pictures)
        self.source = source
        self.noise = noise
        if len(self.pictures) == 2:  # of the mean of both: half the noise of each one
            a, b = self.pictures
            self.noise = float(((a - b) ** 2 / (self.mean**2 + 1e-2)).mean() / 4)

    def squares(self, x):
        """(x - truth)^2 at every pixel and channel, right on average."""
        return (x - self.pictures[0]) * (x - self.pictures[-1])

    def bias(self, x, y, where):
        """relMSE of what two independent pictures of one program have wrong alike, and that
        figure's own standard error, pixels taken as independent; `where` some pixels count."""
        a, b = self.pictures[0], self.pictures[-1]
        product = (x.astype(np.float64) - a) * (y.astype(np.float64) - b)
        pixels = (product / (self.mean**2 + 1e-2)).mean(axis=2)[where]
        noise = self.noise if len(self.pictures) == 1 else 0.0
        return {
            "relmse": float(pixels.mean()) - noise,
            "standard_error": float(pixels.std() / np.sqrt(pixels.size)),
            "share_of_pixels": float(where.mean()),
        }

    def errors(self, picture):
        x = picture.astype(np.float64)
        weight = self.mean**2 + 1e-2
        relmse = float((self.squares(x) / weight).mean())
        if len(self.pictures) == 1:
            relmse -= self.noise
        clipped = np.clip(x, 0, 1)
        square = (clipped - np.clip(self.pictures[0], 0, 1)) * (
            clipped - np.clip(self.pictures[-1], 0, 1)
        )
        means = box_mean(x - self.pictures[0]) * box_mean(x - self.pictures[-1])
        return {
            "relmse": relmse,
            "relmse_of_means": float((means / weight).mean()),
            "rmse_clipped": float(np.sqrt(max(0.0, square.mean()))),
            "energy_ratio": float(x.sum() / self.mean.sum()),
        }


def box_mean(values, radius=4):
    """Each pixel's mean over the square around it: noise goes, a shift or a bias stays."""
    side = 2 * radius + 1
    padded = np.pad(values, ((radius + 1, radius), (radius + 1, radius), (0, 0)), "edge")
    total = padded.cumsum(0).cumsum(1)
    low, high = slice(None, -side), slice(side, None)
    return (total[high, high] - total[low, high] - total[high, low] + total[low, low]) / side**2
