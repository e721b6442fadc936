/* What code of kernels calls, in the library and in WebAssembly: memory in numba's layout, and arithmetic.

   numba lowers for a machine of 64 bits, so sizes have 64 bits everywhere; pointers have those of the machine. */

#include <stddef.h>
#include <stdint.h>

typedef uint64_t Size;

/* -- memory of kernels (numba's layout) ----------------------------------------------------------------------------- */

typedef struct {
    Size count; void (*destroy)(void *, Size, void *); void *about; void *data; Size size; void *allocator;
} Owner;

void *malloc(size_t);
void free(void *);

void *NRT_Allocate(Size size) { return malloc((size_t)size); }

void NRT_Free(void *data) { free(data); }

void *NRT_MemInfo_alloc_aligned(Size size, unsigned align) {
    Size room = sizeof(Owner) + size + 2 * (Size)align;
    Owner *owner = room < size || room > SIZE_MAX ? NULL : malloc((size_t)room);
    if (!owner) return NULL;
    uintptr_t begin = (uintptr_t)(owner + 1);
    *owner = (Owner){1, NULL, NULL, (void *)((begin + align - 1) / align * align), size, NULL};
    return owner;
}

void *NRT_MemInfo_alloc(Size size) { return NRT_MemInfo_alloc_aligned(size, 16); }

void *NRT_MemInfo_alloc_safe_aligned(Size size, unsigned align) { return NRT_MemInfo_alloc_aligned(size, align); }

void NRT_MemInfo_call_dtor(Owner *owner) {
    if (owner->destroy) owner->destroy(owner->data, owner->size, owner->about);
    free(owner);
}

double frexp(double, int *);
double ldexp(double, int);
double numba_frexp(double x, int *exponent) {
    if (x - x != 0.0) { *exponent = 0; return x; }
    return frexp(x, exponent);
}
double numba_ldexp(double x, int exponent) { return ldexp(x, exponent); }
double nextafter(double, double);
double numba_nextafter(double x, double y) { return nextafter(x, y); }

/* -- a b + c with one rounding, for code made for processors that cannot do it -------------------------------------- */

typedef unsigned __int128 Wide;
typedef union { double number; uint64_t bits; } Double;

/* Fraction between 2^52 and 2^53 and exponent of a finite number that is not 0. */
static uint64_t parts(double x, int *exponent) {
    uint64_t bits = (Double){.number = x}.bits, fraction = bits & 0xFFFFFFFFFFFFF;
    int biased = (int)(bits >> 52 & 0x7FF), up = biased ? 0 : __builtin_clzll(fraction) - 11;
    *exponent = (biased ? biased : 1) - 1075 - up;
    return biased ? fraction | 1ull << 52 : fraction << up;
}

/* Shift to the right; what falls out is kept as the last bit. */
static Wide jammed(Wide x, int by) { return by > 127 ? x != 0 : x >> by | ((x >> by) << by != x); }

static double power(int e) { return (Double){.bits = (uint64_t)(e + 1023) << 52}.number; }

/* The number nearest to x 2^e, x > 0, ties to even. */
static double nearest(Wide x, int e) {
    int top = x >> 64 ? 127 - __builtin_clzll((uint64_t)(x >> 64)) : 63 - __builtin_clzll((uint64_t)x);
    int by = top + e >= -1022 ? top - 52 : -1074 - e; /* to 53 bits, or to multiples of the least number */
    uint64_t fraction;
    if (by <= 0) fraction = (uint64_t)(x << -by);
    else {
        Wide few = by > 1 ? jammed(x, by - 2) : x << 1; /* two bits more, the last one standing for all that follow */
        fraction = (uint64_t)(few >> 2) + ((few & 3) + (uint64_t)(few >> 2 & 1) > 2);
    }
    int scale = e + by;
    double found = (double)fraction;
    if (scale < -1022) return found * power(scale + 100) * power(-100); /* a multiple of the least number: exact */
    return scale <= 900 ? found * power(scale) : found * power(900) * power(scale < 1900 ? scale - 900 : 1000);
}

/* Integers alone.  The product and c are aligned with 20 bits to spare, so nothing is lost where they nearly cancel, and
   the last bit stands for what is lost where they do not. */
double fma(double a, double b, double c) {
    if (!(a - a == 0.0) || !(b - b == 0.0) || a == 0.0 || b == 0.0) return a * b + c;
    if (!(c - c == 0.0)) return c + c;
    if (c == 0.0) return a * b;
    int ea, eb, ec;
    Wide p = (Wide)parts(a, &ea) * parts(b, &eb) << 20, s = (Wide)parts(c, &ec) << 72;
    int negative = (a < 0.0) != (b < 0.0), other = c < 0.0, e = ea + eb - 20, apart = e - (ec - 72);
    if (apart >= 0) s = jammed(s, apart);
    else {
        p = jammed(p, -apart);
        e = ec - 72;
    }
    if (negative == other) s += p;
    else if (p == s) return 0.0;
    else if (p > s) s = p - s;
    else {
        s -= p;
        negative = other;
    }
    double found = nearest(s, e);
    return negative ? -found : found;
}
