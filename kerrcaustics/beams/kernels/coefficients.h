// Coefficients of the elementary functions. Written by `python -m studies.truth.elementary_functions`.
#pragma once

// 2 / pi.
constexpr double TWO_OVER_PI = 0x1.45f306dc9c883p-1;
// pi / 2 in three parts: products of the first two with integers below 2^17 are exact.
constexpr double HALF_PI_HIGH = 0x1.921fb54440000p+0;
constexpr double HALF_PI_MIDDLE = 0x1.68c234c400000p-39;
constexpr double HALF_PI_LOW = 0x1.8cc51701b839ap-72;
// pi / 2 and atan(1/2) in two parts: sums of multiples of the first parts are exact.
constexpr double RIGHT_ANGLE = 0x1.921fb54400000p+0;
constexpr double RIGHT_ANGLE_LOW = 0x1.0b4611a626331p-34;
constexpr double ATAN_HALF = 0x1.dac6705400000p-2;
constexpr double ATAN_HALF_LOW = 0x1.0dda7b456fe44p-33;
// 1 / ln(2), and ln(2) in two parts: products of the first with exponents are exact.
constexpr double ONE_OVER_LN2 = 0x1.71547652b82fep+0;
constexpr double LN2_HIGH = 0x1.62e42fefa2000p-1;
constexpr double LN2_LOW = 0x1.9ef35793c7673p-41;
// The upper 32 bits of a^(-1/3) are about this number less a third of those of a.
constexpr double INVERSE_CUBE_ROOT_GUESS = 0x1.54fba55400000p+30;

// sin(r) = r + r z p(z), |r| <= pi / 4; degree 5, largest relative error 2^-56.2.
constexpr double SINE[] = {
    -0x1.5555555555548p-3,
    0x1.111111110f7e4p-7,
    -0x1.a01a019bfff20p-13,
    0x1.71de35694dd9cp-19,
    -0x1.ae5e5b947e599p-26,
    0x1.5d9014ad1df50p-33,
};

// cos(r) = 1 - z / 2 + z^2 p(z), |r| <= pi / 4; degree 5, largest relative error 2^-62.9.
constexpr double COSINE[] = {
    0x1.555555555554bp-5,
    -0x1.6c16c16c15013p-10,
    0x1.a01a019c8f279p-16,
    -0x1.27e4f7f1a3485p-22,
    0x1.1ee9dbe1d3647p-29,
    -0x1.8fa6906382a59p-37,
};

// atan(t) = t + t z p(z), |t| <= 1 / 3; degree 9, largest relative error 2^-59.0.
constexpr double ARC_TANGENT[] = {
    -0x1.555555555554cp-2,
    0x1.999999999793fp-3,
    -0x1.24924923582a6p-3,
    0x1.c71c710b451c1p-4,
    -0x1.745cf709b20a7p-4,
    0x1.3b1043fb090e3p-4,
    -0x1.10d52cb81e815p-4,
    0x1.dc97c0f8c6a01p-5,
    -0x1.895122787f213p-5,
    0x1.ca3913af613bdp-6,
};

// ln((1 + s) / (1 - s)) = 2 s + s z p(z), |s| <= 0.1716; degree 6, largest relative error 2^-59.1.
constexpr double LOGARITHM[] = {
    0x1.5555555555581p-1,
    0x1.9999999984808p-2,
    0x1.2492493e6fa47p-2,
    0x1.c71c548f1a15fp-3,
    0x1.7465c6cea8c4ep-3,
    0x1.39ace22be6359p-3,
    0x1.2e9c97a2ce4c8p-3,
};

// exp(r) = 1 + r + r^2 p(r), |r| <= ln(2) / 2; degree 9, largest relative error 2^-56.2.
constexpr double EXPONENTIAL[] = {
    0x1.0000000000009p-1,
    0x1.55555555554fbp-3,
    0x1.5555555550931p-5,
    0x1.1111111127957p-7,
    0x1.6c16c18408bfdp-10,
    0x1.a01a012aeccccp-13,
    0x1.a0199a5c022e8p-16,
    0x1.71df247ddf6bdp-19,
    0x1.28ad304262400p-22,
    0x1.ad80290ffaf7ep-26,
};

// (1 - h)^(-1/3) = 1 + h p(h), |h| <= 0.102; degree 2, largest relative error 2^-18.5.
constexpr double INVERSE_CUBE_ROOT[] = {
    0x1.555468e82ff8bp-2,
    0x1.c9aefc6489031p-3,
    0x1.652e8c694f675p-3,
};
