// Numbers that are looked up in tables: a call passes each table as a column (`In`) whose stride is the number of rows.
#pragma once

#include "lanes.h"

// Numbers of tables, named by their bytes; of those with two, the bits of finite ones.
typedef double f8;
typedef float f4;
struct f2 {
  unsigned short bits;
};
INLINE double as_double(f8 x) { return x; }
INLINE double as_double(f4 x) { return x; }
INLINE double as_double(f2 x) {
  // The exponent of the same bits in a double is less by 1008.
  return unbits((int64_t)(x.bits & 0x8000) << 48 | (int64_t)(x.bits & 0x7fff) << 42) * 0x1p1008;
}
// A number in row x of a table with rows of WIDTH numbers; in the first or the last row beyond them, so that nothing
// else is ever read.
template <class Number, int WIDTH> INLINE double looked_up(const In &table, int column, double x) {
  const double last = table.stride - 1, row = sel(x > 0.0, sel(x < last, x, last), 0.0);
  return as_double(((const Number *)table.at)[(int64_t)row * WIDTH + column]);
}
#if W > 1
template <class Number, int WIDTH> INLINE V looked_up(const In &table, int column, V x) {
  const V last = V_(table.stride - 1), row = sel(x > 0.0, sel(x < last, x, last), V_(0.0));
  V y;
  for (int l = 0; l < W; l++) y[l] = as_double(((const Number *)table.at)[(int64_t)row[l] * WIDTH + column]);
  return y;
}
#endif
