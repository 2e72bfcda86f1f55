// Elementary functions of lanes and of one number (B is V or double): basic operations alone, within 1 to 1.5 ulp.
//
// NaN gives NaN everywhere, and zeros keep their sign. tests/test_elementary_functions.py has the bounds of the errors.
#pragma once

#include "coefficients.h"
#include "lanes.h"

#define FUNCTION template <class B> INLINE

// 1.5 * 2^52: x + ROUNDER is x as a whole number, in the lowest bits too.
constexpr double ROUNDER = 0x1.8p52;
constexpr int64_t ONE_BITS = 0x3ff0000000000000, MANTISSA = 0x000fffffffffffff;
constexpr double LEAST_NORMAL = 0x1p-1022, LARGEST = 0x1.fffffffffffffp1023;

FUNCTION B abs_(B x) { return unbits(bits(x) & ~SIGN); }
FUNCTION B signed_as(B size, B sign) { return unbits((bits(size) & ~SIGN) | (bits(sign) & SIGN)); }
FUNCTION B copysign_(B size, B sign) { return signed_as(size, sign); }
// As numpy.maximum and numpy.minimum: NaN wins.
FUNCTION B max_(B a, B b) { return sel(a != a, a, sel(a > b, a, b)); }
FUNCTION B min_(B a, B b) { return sel(a != a, a, sel(a < b, a, b)); }
FUNCTION auto finite_(B x) { return abs_(x) <= LARGEST; }
FUNCTION B sign_(B x) { return sel(x > 0.0, fill<B>(1.0), sel(x < 0.0, fill<B>(-1.0), x)); }

// Whole numbers: the nearest (half to even), the next below, the next towards 0.
#if ROUNDS_IN_HARDWARE
INLINE double rint_(double x) { return __builtin_rint(x); }
INLINE double floor_(double x) { return __builtin_floor(x); }
INLINE double trunc_(double x) { return __builtin_trunc(x); }
#endif
#if ROUNDS_IN_HARDWARE && W > 1 && __has_builtin(__builtin_elementwise_rint)
INLINE V rint_(V x) { return __builtin_elementwise_rint(x); }
INLINE V floor_(V x) { return __builtin_elementwise_floor(x); }
INLINE V trunc_(V x) { return __builtin_elementwise_trunc(x); }
#endif
FUNCTION B rint_(B x) {
  B whole = abs_(x) + 0x1p52 - 0x1p52;
  return sel(abs_(x) < 0x1p52, signed_as(whole, x), x);
}
FUNCTION B floor_(B x) {
  B near = rint_(x);
  return sel(near > x, near - 1.0, near);
}
FUNCTION B trunc_(B x) { return signed_as(floor_(abs_(x)), x); }

// x = high + low, of 26 bits each.
FUNCTION B high_half(B x) { return unbits(bits(x) & ~(int64_t)0x7ffffff); }
// The remainder of x / y as C's fmod has it, with the sign of x: exact where |x / y| is below 2^52.
FUNCTION B rem_(B x, B y) {
  B a = abs_(x), b = abs_(y), q = trunc_(a / b);
  B qh = high_half(q), ql = q - qh, bh = high_half(b), bl = b - bh;
  // a - q b, without an error: the quotient may be too large by 1.
  B r = (((a - qh * bh) - qh * bl) - ql * bh) - ql * bl;
  r = sel(r < 0.0, r + b, r);
  r = sel((b == INF) & (a < INF), a, r);
  return signed_as(r, x);
}

// c[FIRST] + c[FIRST + 1] x + ..., COUNT terms, by halves, so that products need not wait for each other.
template <int POWER, class B> INLINE B power(B x) {
  if constexpr (POWER == 1)
    return x;
  else {
    B root = power<POWER / 2>(x);
    return root * root;
  }
}
template <int FIRST, int COUNT, class B, int N> INLINE B terms(B x, const double (&c)[N]) {
  if constexpr (COUNT == 1)
    return fill<B>(c[FIRST]);
  else if constexpr (COUNT == 2)
    return c[FIRST] + c[FIRST + 1] * x;
  else {
    constexpr int HALF = COUNT > 8 ? 8 : COUNT > 4 ? 4 : 2;
    return terms<FIRST, HALF>(x, c) + power<HALF>(x) * terms<FIRST + HALF, COUNT - HALF>(x, c);
  }
}
template <class B, int N> INLINE B polynomial(B x, const double (&c)[N]) { return terms<0, N>(x, c); }

template <class B> struct Pair {
  B s, c;
};
typedef Pair<V> SC;

// Sine and cosine. Beyond |x| = 2e5 the error grows as if x were rounded once more; beyond 2^50 they are NaN.
FUNCTION Pair<B> sincos_(B x) {
  B turns = x * TWO_OVER_PI + ROUNDER, n = turns - ROUNDER;
  B first = x - n * HALF_PI_HIGH, second = n * HALF_PI_MIDDLE;
  // The angle is r - excess.
  B r = first - second, excess = ((r - first) + second) + n * HALF_PI_LOW;
  r = sel(abs_(x) < 0x1p50, r, fill<B>(NOTANUMBER));
  B z = r * r, half = 0.5 * z, one = 1.0 - half;
  // Subtractions in this order keep the sign of -0.
  B s = r - (excess * one - r * z * polynomial(z, SINE));
  B c = one + (((1.0 - one) - half) + (z * z * polynomial(z, COSINE) + r * excess));
  auto quadrant = bits(turns);
  auto odd = (quadrant & 1) != 0;
  auto sine_sign = shifted_left(quadrant, 62) & SIGN, cosine_sign = shifted_left(quadrant + 1, 62) & SIGN;
  return {unbits(bits(sel(odd, c, s)) ^ sine_sign), unbits(bits(sel(odd, s, c)) ^ cosine_sign)};
}
FUNCTION B sin_(B x) { return sincos_(x).s; }
FUNCTION B cos_(B x) { return sincos_(x).c; }

// The tangent of the angle of (high, low), 0 <= low <= high; where `middle` holds, counted from atan(1/2).
template <class B, class K> INLINE B tangent_(B low, B high, K middle) {
  return (low - only(middle, 0.5 * high)) / (high + only(middle, 0.5 * low));
}
// base + base_low + that angle by its tangent t, the other way round where `reverse` has the sign bit.
template <class B, class K, class Bits> INLINE B angle_(B t, K middle, Bits reverse, B base, B base_low) {
  t = unbits(bits(t) ^ reverse);
  B half = unbits(bits(only(middle, fill<B>(ATAN_HALF))) ^ reverse);
  B half_low = unbits(bits(only(middle, fill<B>(ATAN_HALF_LOW))) ^ reverse);
  B z = t * t;
  // from + t without an error, since |from| >= |t| or from = 0.
  B from = base + half, sum = from + t, error = (from - sum) + t;
  return sum + (error + (t * z * polynomial(z, ARC_TANGENT) + (base_low + half_low)));
}
FUNCTION B atan_(B x) {
  B a = abs_(x), one = fill<B>(1.0);
  auto steep = a > 1.0;
  B low = sel(steep, one, a), high = sel(steep, a, one);
  auto middle = 3.0 * low > high;
  B right = only(steep, fill<B>(RIGHT_ANGLE)), right_low = only(steep, fill<B>(RIGHT_ANGLE_LOW));
  return signed_as(angle_(tangent_(low, high, middle), middle, sign_where(steep), right, right_low), x);
}
// Digits are lost where x and y are both subnormal.
FUNCTION B atan2_(B y, B x) {
  B a = abs_(x), b = abs_(y);
  auto steep = b > a;
  B low = sel(steep, a, b), high = sel(steep, b, a);
  auto infinite = (low == INF) & (high == INF);
  auto middle = (3.0 * low > high) | infinite;
  B t = tangent_(low, high, middle);
  t = sel(infinite, fill<B>(1.0 / 3.0), sel(high == 0.0, low, t));
  // The angle is counted from 0, 1 or 2 right angles.
  B right = sel(steep, fill<B>(1.0), only(bits(x) < 0, fill<B>(2.0)));
  auto reverse = sign_where(steep) ^ (bits(x) & SIGN);
  return signed_as(angle_(t, middle, reverse, B(right * RIGHT_ANGLE), B(right * RIGHT_ANGLE_LOW)), y);
}

// ln(x) = exponent ln(2) + ln(1 + f), sqrt(1/2) <= 1 + f < sqrt(2), for positive normal numbers.
template <class B> struct Logarithm {
  B exponent, f;
};
FUNCTION Logarithm<B> split_(B x) {
  constexpr int64_t root_half = 0x3fe6a09e667f3bcd, magic = 0x4330000000000000;
  auto b = bits(x), shifted = b + (ONE_BITS - root_half);
  B exponent = unbits(shifted_right(shifted, 52) | magic) - (0x1p52 + 1023.0);
  return {exponent, unbits(b - (shifted & ~MANTISSA) + ONE_BITS) - 1.0};
}
// The logarithm of its parts; of 1 + f (1 + small) (the rest of s is known) in log1p_.
FUNCTION B joined_(Logarithm<B> of, B s, B small) {
  B f = of.f, z = s * s, half = 0.5 * f * f;
  B rest = s * (half + z * polynomial(z, LOGARITHM)) + (of.exponent * LN2_LOW + small);
  return of.exponent * LN2_HIGH - ((half - rest) - f);
}
// Logarithms of 0, of infinity, and of what has none.
FUNCTION B with_ends(B x, B logarithm) {
  B y = sel(x < INF, logarithm, x);
  return sel(x >= LEAST_NORMAL, y, sel(x >= 0.0, fill<B>(-INF), fill<B>(NOTANUMBER)));
}
// Numbers below the least normal one, 2e-308, count as 0: to scale them would cost an eighth of the time.
FUNCTION B log_(B x) {
  Logarithm<B> of = split_<B>(x);
  return with_ends<B>(x, joined_<B>(of, of.f / (2.0 + of.f), fill<B>(0.0)));
}
FUNCTION B log1p_(B x) {
  B u = 1.0 + x;
  Logarithm<B> of = split_<B>(u);
  B s = of.f / (2.0 + of.f), other = 1.0 - s;
  // The rounding of u over u: 1 / (1 + f) is (1 - s)^2 to 3 %.
  auto scale = shifted_left(bits(ROUNDER + 1023.0 - of.exponent), 52);
  B small = (x - (u - 1.0)) * unbits(scale) * (other * other);
  B y = with_ends<B>(u, joined_<B>(of, s, small));
  return sel(x == 0.0, x, y);
}

FUNCTION B exp_(B x) {
  // Beyond these ends the answer is infinite or 0.
  B y = min_(max_(x, fill<B>(-746.0)), fill<B>(710.0));
  B whole = y * ONE_OVER_LN2 + ROUNDER, n = whole - ROUNDER;
  B high = y - n * LN2_HIGH, low = n * LN2_LOW, r = high - low;
  B e = 1.0 + (high + (r * r * polynomial(r, EXPONENTIAL) - low));
  // 2^n in two factors, each of which is a normal number.
  auto biased = bits(whole) - (bits(ROUNDER) - 2046), one = shifted_right(biased, 1);
  return e * unbits(shifted_left(one, 52)) * unbits(shifted_left(biased - one, 52));
}

FUNCTION B cbrt_(B x) {
  constexpr int64_t magic = 0x4330000000000000, first_17_bits = ~(int64_t)0xfffffffff;
  auto subnormal = abs_(x) < LEAST_NORMAL;
  B a = sel(subnormal, abs_(x) * 0x1p54, abs_(x));
  // A third of the exponent, and with it of the logarithm's first bits.
  B word = unbits(shifted_right(bits(a), 32) | magic) - 0x1p52;
  B r = unbits(shifted_left(bits((ROUNDER + INVERSE_CUBE_ROOT_GUESS) - word * (1.0 / 3.0)), 32));
  B h = 1.0 - a * r * r * r;
  r = r + r * (h * polynomial(h, INVERSE_CUBE_ROOT));
  // The cube of 17 bits has no error, nor has its difference from a.
  B t = unbits(bits(B(a * r * r)) & first_17_bits), d = (a - t * t * t) / a;
  // (1 - d)^(-1/3), d < 2^-14.
  t = t + t * (d * (1.0 / 3.0 + d * (2.0 / 9.0 + d * (14.0 / 81.0))));
  t = t * sel(subnormal, fill<B>(0x1p-18), fill<B>(1.0));
  return signed_as(sel((a > 0.0) & (a < INF), t, a), x);
}
