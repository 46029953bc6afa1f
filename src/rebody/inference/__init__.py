"""Task inference: encoder, decoder, priors and their loss. Nothing here knows a policy."""

from rebody.inference.encoder import Encoder, EncoderCarry
from rebody.inference.module import InferenceConfig, InferenceModule

__all__ = ["Encoder", "EncoderCarry", "InferenceConfig", "InferenceModule"]
