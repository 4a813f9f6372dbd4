"""Fit a cloth's colour to a picture with PyTorch: plycloth as one function of its autograd graph.

Needs PyTorch beside plycloth. `Cells` is all that is specific to the two; the rest is any training
loop. Run it by `python examples/pytorch_fit.py`.
"""

import sys
from dataclasses import replace

import numpy as np
import plycloth as pc

try:
    import torch
except ImportError:
    sys.exit("this example needs PyTorch: see https://pytorch.org/get-started")


class Cells(torch.autograd.Function):
    """Averages of a picture's cells as a function of the yarns' base colour."""

    @staticmethod
    def forward(ctx, color, scene, seed):
        """Render, and keep the derivatives for the way back."""
        bsdf = replace(scene.swatch.fabric.warp.bsdf, base_color=color.detach().tolist())
        values, gradient = pc.value_and_gradient(
            scene.with_bsdfs(bsdf, bsdf), ["base_color"], cells=8, paths=64, seed=seed
        )
        ctx.gradient = torch.from_numpy(gradient["base_color"])
        return torch.from_numpy(values)

    @staticmethod
    def backward(ctx, upstream):
        """Multiply what comes from above (cells x channels) by the derivatives."""
        return torch.tensordot(upstream, ctx.gradient, dims=3), None, None


def cloth(color):
    """Make a scene of a plain weave of one colour, seen from above."""
    yarn = pc.RoundYarn(0.1, pc.PlyBsdf(base_color=color), plies=1)
    fabric = pc.Fabric(pc.WeavePattern.plain(), yarn, yarn, 0.25, 0.25).fitted()
    return pc.photo_rig(fabric, "front", resolution=(64, 64))


def main():
    """Find the colour that a picture was rendered with."""
    hidden = (0.7, 0.4, 0.2)
    target, _ = pc.value_and_gradient(cloth(hidden), [], cells=8, paths=4096, seed=1)
    target = torch.from_numpy(target)
    scene = cloth(0.5)
    color = torch.full((3,), 0.5, dtype=torch.float64, requires_grad=True)
    optimiser = torch.optim.Adam([color], lr=0.03)
    for step in range(100):
        optimiser.zero_grad()
        # New paths for each step: no noise is fitted.
        loss = ((Cells.apply(color, scene, step + 2) - target) ** 2).mean()
        loss.backward()
        optimiser.step()
        with torch.no_grad():
            color.clamp_(0.0, 1.0)
    print("hidden", np.array(hidden), "found", color.detach().numpy().round(3))


if __name__ == "__main__":
    main()
