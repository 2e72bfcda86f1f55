// Lanes: W numbers in a vector V, W truth values in a mask M (-1 or 0; for one lane 1 or 0).
//
// Every function exists for lanes and for one number, since whatever depends on the call alone is computed once.
// Only operations that IEEE 754 rounds exactly are used, so that answers are equal to the bit for any W, compiler
// and machine. Compile with -ffp-contract=off: a product and a sum in one instruction round differently.
#pragma once

typedef __INT64_TYPE__ int64_t;
typedef __UINT64_TYPE__ uint64_t;

#ifndef W
#define W 4
#endif
#ifndef __has_builtin
#define __has_builtin(name) 0
#endif
// Rounding to whole numbers is one instruction here; elsewhere a compiler may call a library, which kernels lack.
#if defined(__SSE4_1__) || defined(__aarch64__) || defined(__wasm__)
#define ROUNDS_IN_HARDWARE 1
#else
#define ROUNDS_IN_HARDWARE 0
#endif

// The sign bit of a double.
#define SIGN ((int64_t)1 << 63)
#define INF __builtin_inf()
#define NOTANUMBER __builtin_nan("")
#define INLINE static inline __attribute__((always_inline))

// One column of numbers: `stride` counts elements, and is 0 where all rays share one number.
struct In {
  const double *at;
  int64_t stride;
};
struct Out {
  void *at;
  int64_t stride;
};

#if W > 1
typedef double V __attribute__((vector_size(8 * W)));
typedef int64_t M __attribute__((vector_size(8 * W)));
typedef uint64_t Unsigned __attribute__((vector_size(8 * W)));
typedef signed char Bytes __attribute__((vector_size(W)));
#if !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi"
#endif
#else
typedef double V;
typedef int64_t M;
#endif

// One number as B, which is V or double. 0 is subtracted, not added: that keeps the sign of -0.
template <class B> INLINE B fill(double x) { return x - B{}; }
INLINE V V_(double x) { return fill<V>(x); }

INLINE double sel(int64_t m, double a, double b) { return m ? a : b; }
INLINE int64_t selm(int64_t m, int64_t a, int64_t b) { return m ? a : b; }
INLINE int64_t not_(int64_t m) { return !m; }
INLINE double real_(int64_t m) { return m ? 1.0 : 0.0; }
INLINE int64_t any_(int64_t m) { return m != 0; }
INLINE int64_t bits(double x) { return __builtin_bit_cast(int64_t, x); }
INLINE double unbits(int64_t b) { return __builtin_bit_cast(double, b); }
// Bits moved to the right, zeros moved in.
INLINE int64_t shifted_right(int64_t b, int places) { return (int64_t)((uint64_t)b >> places); }
INLINE int64_t shifted_left(int64_t b, int places) { return (int64_t)((uint64_t)b << places); }
// x where m holds, otherwise 0.
INLINE double only(int64_t m, double x) { return m ? x : 0.0; }
// The sign bit where m holds.
INLINE int64_t sign_where(int64_t m) { return m ? SIGN : 0; }
INLINE double sqrt_(double x) { return __builtin_sqrt(x); }

#if W > 1
INLINE M M_(int64_t x) { return (x ? -1 : 0) - M{}; }
INLINE V sel(M m, V a, V b) { return m ? a : b; }
INLINE M selm(M m, M a, M b) { return (m & a) | (~m & b); }
INLINE M not_(M m) { return ~m; }
INLINE M bits(V x) { return (M)x; }
INLINE V unbits(M b) { return (V)b; }
INLINE V real_(M m) { return unbits(m & bits(V_(1.0))); }
INLINE M shifted_right(M b, int places) { return (M)((Unsigned)b >> places); }
INLINE M shifted_left(M b, int places) { return (M)((Unsigned)b << places); }
INLINE V only(M m, V x) { return unbits(m & bits(x)); }
INLINE M sign_where(M m) { return shifted_left(m, 63); }
INLINE int64_t any_(M m) {
#if __has_builtin(__builtin_reduce_or)
  return __builtin_reduce_or(m);
#else
  int64_t any = 0;
  for (int l = 0; l < W; l++) any |= m[l];
  return any;
#endif
}
INLINE V sqrt_(V x) {
#if __has_builtin(__builtin_elementwise_sqrt)
  return __builtin_elementwise_sqrt(x);
#elif W == 8 && defined(__AVX512F__)
  return __builtin_ia32_sqrtpd512_mask(x, x, -1, 4);
#elif W == 4 && defined(__AVX__)
  return __builtin_ia32_sqrtpd256(x);
#elif W == 2 && defined(__SSE2__)
  return __builtin_ia32_sqrtpd(x);
#else
  V root;
  for (int l = 0; l < W; l++) root[l] = __builtin_sqrt(x[l]);
  return root;
#endif
}

// Lanes i to i + W - 1 of column k of n numbers; lanes beyond the last number repeat it.
INLINE V load(const In *in, int k, int64_t i, int64_t n) {
  const double *at = in[k].at;
  const int64_t stride = in[k].stride;
  V x;
  if (i + W <= n && stride == 1)
    __builtin_memcpy(&x, at + i, sizeof x);
  else if (i + W <= n)
    for (int l = 0; l < W; l++) x[l] = at[(i + l) * stride];
  else
    for (int l = 0; l < W; l++) x[l] = at[(i + l < n ? i + l : n - 1) * stride];
  return x;
}
template <class Number, class X> INLINE void store(const Out &out, int64_t i, int64_t n, X x) {
  Number *at = (Number *)out.at;
  if (i + W <= n && out.stride == 1)
    __builtin_memcpy(at + i, &x, sizeof x);
  else
    for (int l = 0; l < W; l++)
      if (i + l < n) at[(i + l) * out.stride] = x[l];
}
INLINE Bytes bytes(M x) { return __builtin_convertvector(x, Bytes); }
INLINE void store_f(const Out *out, int k, int64_t i, int64_t n, V x) { store<double>(out[k], i, n, x); }
INLINE void store_b(const Out *out, int k, int64_t i, int64_t n, M x) { store<signed char>(out[k], i, n, bytes(x & 1)); }
INLINE void store_i(const Out *out, int k, int64_t i, int64_t n, V x) {
  store<signed char>(out[k], i, n, bytes(__builtin_convertvector(x, M)));
}
#else
INLINE M M_(int64_t x) { return x != 0; }
INLINE V load(const In *in, int k, int64_t i, int64_t) { return in[k].at[i * in[k].stride]; }
INLINE void store_f(const Out *out, int k, int64_t i, int64_t, V x) { ((double *)out[k].at)[i * out[k].stride] = x; }
INLINE void store_b(const Out *out, int k, int64_t i, int64_t, M x) {
  ((signed char *)out[k].at)[i * out[k].stride] = x != 0;
}
INLINE void store_i(const Out *out, int k, int64_t i, int64_t, V x) {
  ((signed char *)out[k].at)[i * out[k].stride] = (signed char)x;
}
#endif
