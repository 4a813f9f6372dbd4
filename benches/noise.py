"""How noisy pictures are: `python -m benches.noise`.

The standard deviation of a pixel at 16 samples, root mean square over the picture and all channels,
over the picture's mean; seen by `overview` in two lights. "guide" is the fabric of docs/guide.md,
"silk" the same of ribbons alone, "dark" of dark round yarns. Takes ten seconds.
"""

import numpy as np
import plycloth as pc

SAMPLES, SPP = 64, 16


def fabrics():
    """The fabrics by name."""
    silk = pc.PlyBsdf(
        base_color=(0.7, 0.1, 0.15), transmitted_color=(0.8, 0.1, 0.2), roughness=(0.1, 0.2)
    )
    dark = pc.PlyBsdf(base_color=0.05, transmitted_color=0.05, roughness=(0.1, 0.2))
    ribbon = pc.FlatYarn(width_mm=0.28, bsdf=silk)
    yarns = {
        "guide": (ribbon, pc.RoundYarn(radius_mm=0.12, bsdf=silk, plies=2)),
        "silk": (ribbon, ribbon),
        "dark": (pc.RoundYarn(radius_mm=0.12, bsdf=dark, plies=2),) * 2,
    }
    pattern = pc.WeavePattern.satin(5, 2)
    return {name: pc.Fabric(pattern, *sets, 0.3, 0.3) for name, sets in yarns.items()}


def noise(fabric, light):
    """Noise at SPP samples per pixel over the mean, and the mean with its standard error."""
    scene = pc.overview(fabric, light, width=64)
    image = pc.render(scene, spp=SAMPLES, seed=1, progress=False)
    mean = image.pixels.mean(dtype=float)
    variance = image.variance.astype(float)
    error = np.sqrt(variance.sum()) / variance.size
    return np.sqrt(variance.mean() * SAMPLES / SPP) / mean, mean, error


def main():
    """Print the table."""
    for name, fabric in fabrics().items():
        for light in ("day", "back"):
            relative, mean, error = noise(fabric, light)
            print(f"{name:6} {light:5} noise {relative:6.1%} mean {mean:.4f} +- {error:.4f}")


if __name__ == "__main__":
    main()
