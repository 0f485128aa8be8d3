"""SPIR-V opcodes: the supported instructions, and descriptions of rejected ones."""

from __future__ import annotations

TYPES = {
    19: "void", 20: "bool", 21: "int", 22: "float", 23: "vector", 24: "matrix", 25: "image", 26: "sampler",
    27: "sampled image", 28: "array", 29: "runtime array", 30: "struct", 31: "opaque", 32: "pointer", 33: "function",
}  # fmt: skip

NAMES = {
    1: "Undef", 12: "ExtInst", 41: "ConstantTrue", 42: "ConstantFalse", 43: "Constant", 44: "ConstantComposite",
    46: "ConstantNull", 48: "SpecConstantTrue", 49: "SpecConstantFalse", 50: "SpecConstant",
    51: "SpecConstantComposite", 52: "SpecConstantOp", 54: "Function", 55: "FunctionParameter", 56: "FunctionEnd",
    57: "FunctionCall", 59: "Variable", 61: "Load", 62: "Store", 63: "CopyMemory", 65: "AccessChain",
    66: "AccessChain", 77: "VectorExtractDynamic", 78: "VectorInsertDynamic", 79: "VectorShuffle",
    80: "CompositeConstruct", 81: "CompositeExtract", 82: "CompositeInsert", 83: "CopyObject", 84: "Transpose",
    86: "SampledImage", 87: "ImageSample", 88: "ImageSample", 95: "ImageFetch", 100: "Image", 103: "ImageQuerySize",
    104: "ImageQuerySize", 109: "ConvertFToI", 110: "ConvertFToI", 111: "ConvertIToF", 112: "ConvertIToF",
    124: "Bitcast", 126: "SNegate", 127: "FNegate", 128: "IAdd", 129: "FAdd", 130: "ISub", 131: "FSub", 132: "IMul",
    133: "FMul", 134: "UDiv", 135: "SDiv", 136: "FDiv", 137: "UMod", 138: "SRem", 139: "SMod", 140: "FRem",
    141: "FMod", 142: "VectorTimesScalar", 143: "MatrixTimesScalar", 144: "VectorTimesMatrix",
    145: "MatrixTimesVector", 146: "MatrixTimesMatrix", 147: "OuterProduct", 148: "Dot", 154: "Any", 155: "All",
    156: "IsNan", 157: "IsInf", 164: "LogicalEqual", 165: "LogicalNotEqual", 166: "LogicalOr", 167: "LogicalAnd",
    168: "LogicalNot", 169: "Select", 170: "IEqual", 171: "INotEqual", 172: "IGreater", 173: "IGreater",
    174: "IGreaterEqual", 175: "IGreaterEqual", 176: "ILess", 177: "ILess", 178: "ILessEqual", 179: "ILessEqual",
    180: "FOrdEqual", 181: "FUnordEqual", 182: "FOrdNotEqual", 183: "FUnordNotEqual", 184: "FOrdLess",
    185: "FUnordLess", 186: "FOrdGreater", 187: "FUnordGreater", 188: "FOrdLessEqual", 189: "FUnordLessEqual",
    190: "FOrdGreaterEqual", 191: "FUnordGreaterEqual", 194: "ShiftRightLogical", 195: "ShiftRightArithmetic",
    196: "ShiftLeft", 197: "BitwiseOr", 198: "BitwiseXor", 199: "BitwiseAnd", 200: "Not", 201: "BitFieldInsert",
    202: "BitFieldSExtract", 203: "BitFieldUExtract", 204: "BitReverse", 205: "BitCount", 245: "Phi",
    246: "LoopMerge", 247: "SelectionMerge", 248: "Label", 249: "Branch", 250: "BranchConditional", 251: "Switch",
    252: "Kill", 253: "Return", 254: "ReturnValue", 255: "Unreachable", 400: "CopyObject",
}  # fmt: skip

_RANGES = [
    (range(60, 61), "a pointer to a texel of an image"),
    (range(89, 95), "a shadow or projective texture lookup"),
    (range(96, 98), "a texture gather"),
    (range(98, 99), "a read of a storage image"),
    (range(99, 100), "a write to an image"),
    (range(105, 108), "a query of a texture's levels"),
    (range(113, 118), "a conversion between number widths (doubles and 16-bit types)"),
    (range(207, 216), "a screen-space derivative (dFdx, dFdy, fwidth)"),
    (range(224, 226), "a barrier"),
    (range(227, 243), "an atomic operation"),
    (range(318, 320), "an atomic operation"),
    (range(256, 300), "a subgroup or kernel operation"),
    (range(333, 367), "a subgroup operation"),
    (range(4416, 4418), "discard"),
    (range(4421, 4480), "a subgroup or ray operation"),
    (range(5380, 5381), "discard"),
]
REFUSED = {opcode: what for opcodes, what in _RANGES for opcode in opcodes}
