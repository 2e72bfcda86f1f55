// The instruction set of the processor that runs this.

#if defined(__x86_64__)
struct Registers {
  unsigned a, b, c, d;
};

static Registers cpuid(unsigned leaf) {
  Registers r;
  __asm__("cpuid" : "=a"(r.a), "=b"(r.b), "=c"(r.c), "=d"(r.d) : "a"(leaf), "c"(0));
  return r;
}

// The registers that the operating system keeps for each thread.
static unsigned kept_registers() {
  unsigned low, high;
  __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return low;
}

static bool all(unsigned flags, unsigned wanted) { return (flags & wanted) == wanted; }

constexpr unsigned bit(int place) { return 1u << place; }

// 4, 3 or 2 for x86-64-v4, -v3 or -v2, as the psABI defines them; 0 if none of them can run.
static int level() {
  if (cpuid(0x80000000u).a < 0x80000001u) return 0;
  const Registers basic = cpuid(1), extended = cpuid(0x80000001u);
  // SSE3, SSSE3, CMPXCHG16B, SSE4.1, SSE4.2, POPCNT; LAHF.
  if (!all(basic.c, bit(0) | bit(9) | bit(13) | bit(19) | bit(20) | bit(23)) || !all(extended.c, bit(0))) return 0;
  if (cpuid(0).a < 7) return 2;
  const Registers more = cpuid(7);
  // FMA, MOVBE, OSXSAVE, AVX, F16C; BMI1, AVX2, BMI2; LZCNT.
  if (!all(basic.c, bit(12) | bit(22) | bit(27) | bit(28) | bit(29)) || !all(more.b, bit(3) | bit(5) | bit(8)) ||
      !all(extended.c, bit(5)))
    return 2;
  const unsigned kept = kept_registers();
  // XMM, YMM.
  if (!all(kept, bit(1) | bit(2))) return 2;
  // AVX512F, DQ, CD, BW, VL; opmask, ZMM.
  if (!all(more.b, bit(16) | bit(17) | bit(28) | bit(30) | bit(31)) || !all(kept, bit(5) | bit(6) | bit(7))) return 3;
  return 4;
}
#else
static int level() { return 0; }
#endif

extern "C" int kernel_level() { return level(); }
