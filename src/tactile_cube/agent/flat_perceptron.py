"""A perceptron whose parameters and gradients are views of flat vectors, with its backward pass written out.

One flat vector makes the optimiser, the target update and the cast to bfloat16 one operation each, and a written
backward pass computes what is used and nothing else: no weight gradients of the critics in the actor's loss, say.
"""

import itertools
from collections.abc import Sequence

import torch
from torch import Tensor, nn

from tactile_cube.agent.networks import linear_layers
from tactile_cube.agent.settings import multiplies_bfloat16

LAYER_NORM_EPS = 1e-5
FUSES = multiplies_bfloat16() and hasattr(torch.ops.mkldnn, "_linear_pointwise")
"""Whether oneDNN's product with bias and ReLU in one is there; torch's compiler calls it, no public function does."""

Activation = tuple[Tensor, Tensor, Tensor | None, Tensor | None]
"""A layer's input, its product before normalisation, and the normalisation's mean and 1/sigma."""


def parameter_count(sizes: Sequence[int]) -> int:
    """Weights and biases of a perceptron with these widths."""
    return sum((fan_in + 1) * fan_out for fan_in, fan_out in itertools.pairwise(sizes))


def affine(x: Tensor, weight: Tensor, bias: Tensor, rectify: bool) -> Tensor:
    """Product of input and weight plus bias, then ReLU if asked; bfloat16 on a CPU in one pass with the same bits."""
    if x.dtype == torch.bfloat16 and FUSES and not x.is_cuda:
        result: Tensor = torch.ops.mkldnn._linear_pointwise(x, weight.t(), bias, "relu" if rectify else "none", [], "")
        return result
    product = torch.addmm(bias, x, weight)
    return product.relu_() if rectify else product


def rectify_gradient_(gradient: Tensor, after_relu: Tensor) -> Tensor:
    """The gradient, in place, where ReLU gave more than zero, else zero.

    Both are taken for integers, which have the same sign and zero: a CPU compares them three times as fast as bfloat16.
    """
    whole = torch.int16 if gradient.dtype == torch.bfloat16 else torch.int32
    bits = gradient.view(whole)
    torch.ops.aten.threshold_backward.grad_input(bits, after_relu.view(whole), 0, grad_input=bits)
    return gradient


class FlatPerceptron:
    """Linear layers with ReLU (and LayerNorm without scale and shift) between them, living in flat vectors.

    Args:
        sizes: widths of input, hidden layers and output.
        weights: flat parameters, `parameter_count(sizes)` long; read at every pass.
        gradients: flat gradients of the same length and dtype, or None for a network that is never trained (targets).
        layer_norm: normalise the hidden layers.
    """

    def __init__(self, sizes: Sequence[int], weights: Tensor, gradients: Tensor | None, layer_norm: bool = False):
        self.sizes = tuple(sizes)
        self.layer_norm = layer_norm
        self.layers = _layer_views(self.sizes, weights)
        self.gradients = _layer_views(self.sizes, gradients) if gradients is not None else []

    def forward(self, x: Tensor) -> tuple[Tensor, list[Activation]]:
        """Output (batch, sizes[-1]) and what `backward` needs."""
        kept: list[Activation] = []
        for weight, bias in self.layers[:-1]:
            product = affine(x, weight, bias, rectify=not self.layer_norm)
            normalised, mean, inverse = self._normalise(product)
            kept.append((x, product, mean, inverse))
            x = normalised.relu() if self.layer_norm else product
        weight, bias = self.layers[-1]
        kept.append((x, x, None, None))
        return affine(x, weight, bias, rectify=False), kept

    def backward(self, kept: list[Activation], gradient: Tensor, rows: slice) -> Tensor:
        """Write the parameters' gradients of the given rows; give the gradient at the first layer's product, all rows.

        Args:
            kept: activations of the forward pass.
            gradient: of the loss with respect to the output, (batch, sizes[-1]).
            rows: the part of the batch whose loss trains this network.
        """
        for index in range(len(self.layers) - 1, -1, -1):
            weight_gradient, bias_gradient = self.gradients[index]
            torch.mm(kept[index][0][rows].t(), gradient[rows], out=weight_gradient)
            torch.sum(gradient[rows], 0, out=bias_gradient)
            if index > 0:
                after_relu = kept[index][0]
                gradient = rectify_gradient_(torch.mm(gradient, self.layers[index][0].t()), after_relu)
                gradient = self._normalise_backward(gradient, kept[index - 1])
        return gradient

    def input_gradient(self, first_product_gradient: Tensor, columns: slice) -> Tensor:
        """Gradient with respect to some columns of the input, from what `backward` gave."""
        return torch.mm(first_product_gradient, self.layers[0][0][columns].t())

    def _normalise(self, product: Tensor) -> tuple[Tensor, Tensor | None, Tensor | None]:
        if not self.layer_norm:
            return product, None, None
        normalised, mean, inverse = torch.native_layer_norm(product, (product.shape[1],), None, None, LAYER_NORM_EPS)
        return normalised, mean, inverse

    def _normalise_backward(self, gradient: Tensor, kept: Activation) -> Tensor:
        if not self.layer_norm:
            return gradient
        _, product, mean, inverse = kept
        wanted = [True, False, False]
        backward = torch.ops.aten.native_layer_norm_backward
        result: Tensor = backward(gradient, product, (product.shape[1],), mean, inverse, None, None, wanted)[0]
        return result

    @torch.no_grad()
    def copy_from(self, module: nn.Sequential) -> None:
        """Take the parameters of a torch perceptron of the same widths."""
        for (weight, bias), linear in zip(self.layers, linear_layers(module), strict=True):
            weight.copy_(linear.weight.t())
            bias.copy_(linear.bias)

    @torch.no_grad()
    def copy_to(self, module: nn.Sequential) -> None:
        """Give the parameters to a torch perceptron of the same widths."""
        for (weight, bias), linear in zip(self.layers, linear_layers(module), strict=True):
            linear.weight.copy_(weight.t())
            linear.bias.copy_(bias)


def _layer_views(sizes: tuple[int, ...], flat: Tensor) -> list[tuple[Tensor, Tensor]]:
    views, start = [], 0
    for fan_in, fan_out in itertools.pairwise(sizes):
        weight = flat[start : start + fan_in * fan_out].view(fan_in, fan_out)
        start += fan_in * fan_out
        views.append((weight, flat[start : start + fan_out]))
        start += fan_out
    return views
