/* What a WebAssembly module has besides its kernels: memory, and the few functions that compiled code calls. */

#include "support.h"

/* -- memory: blocks of four lengths to every power of two, each kind in a list of free ones; new ones at the end ---- */

typedef union Block { union Block *next; struct { uint32_t kind; } head; char room[16]; } Block;
enum { PAGE = 1 << 16 };

extern char __heap_base;
static uintptr_t top;
static Block *spare[108];

__attribute__((export_name("allocate"))) void *malloc(size_t size) {
    if (size > (1u << 31) - sizeof(Block)) return NULL;
    uint32_t last = (uint32_t)(size + sizeof(Block)) - 1, step = last < 64 ? 4 : 29 - __builtin_clz(last);
    uint32_t kind = 4 * (step - 4) + (last >> step);
    Block *block = spare[kind];
    if (block) spare[kind] = block->next;
    else {
        size_t length = (size_t)((last >> step) + 1) << step;
        if (!top) top = ((uintptr_t)&__heap_base + 15) & ~(uintptr_t)15;
        uint64_t end = (uint64_t)top + length, have = (uint64_t)__builtin_wasm_memory_size(0) * PAGE;
        if (end > UINT32_MAX) return NULL;
        if (end > have && __builtin_wasm_memory_grow(0, (size_t)((end - have + PAGE - 1) / PAGE)) == SIZE_MAX) return NULL;
        block = (Block *)top;
        top = (uintptr_t)end;
    }
    block->head.kind = kind;
    return block + 1;
}

__attribute__((export_name("release"))) void free(void *data) {
    if (!data) return;
    Block *block = (Block *)data - 1;
    uint32_t kind = block->head.kind;
    block->next = spare[kind];
    spare[kind] = block;
}

/* An array that a kernel has returned was read. */
__attribute__((export_name("drop"))) void drop(Owner *owner) {
    if (owner && --owner->count == 0) NRT_MemInfo_call_dtor(owner);
}

void *memcpy(void *to, const void *from, size_t size) { return __builtin_memcpy(to, from, size); }
void *memmove(void *to, const void *from, size_t size) { return __builtin_memmove(to, from, size); }
void *memset(void *to, int byte, size_t size) { return __builtin_memset(to, byte, size); }

/* -- numbers of 128 bits ---------------------------------------------------------------------------------------------- */

typedef union { Wide all; struct { uint64_t low, high; } half; } Halves;

Wide __ashlti3(Wide x, int by) {
    Halves from = {.all = x}, to;
    if (by & 64) to.half.low = 0, to.half.high = from.half.low << (by & 63);
    else if (by == 0) return x;
    else to.half.low = from.half.low << by, to.half.high = from.half.high << by | from.half.low >> (64 - by);
    return to.all;
}

Wide __lshrti3(Wide x, int by) {
    Halves from = {.all = x}, to;
    if (by & 64) to.half.high = 0, to.half.low = from.half.high >> (by & 63);
    else if (by == 0) return x;
    else to.half.high = from.half.high >> by, to.half.low = from.half.low >> by | from.half.high << (64 - by);
    return to.all;
}

Wide __multi3(Wide x, Wide y) {
    Halves a = {.all = x}, b = {.all = y}, to;
    uint64_t al = (uint32_t)a.half.low, ah = a.half.low >> 32, bl = (uint32_t)b.half.low, bh = b.half.low >> 32;
    uint64_t low = al * bl, one = ah * bl + (low >> 32), two = al * bh + (uint32_t)one;
    to.half.low = two << 32 | (uint32_t)low;
    to.half.high = ah * bh + (one >> 32) + (two >> 32) + a.half.low * b.half.high + a.half.high * b.half.low;
    return to.all;
}

/* -- numbers -------------------------------------------------------------------------------------------------------- */

double frexp(double x, int *exponent) {
    if (x == 0.0) { *exponent = 0; return x; }
    uint64_t fraction = parts(x, exponent);
    *exponent += 53;
    double found = (double)fraction * 0x1p-53;
    return x < 0.0 ? -found : found;
}

double ldexp(double x, int by) {
    if (x == 0.0 || x - x != 0.0) return x;
    int exponent;
    uint64_t fraction = parts(x, &exponent);
    double found = nearest(fraction, exponent + (by > 5000 ? 5000 : by < -5000 ? -5000 : by));
    return x < 0.0 ? -found : found;
}

double nextafter(double x, double y) {
    if (x != x || y != y) return x + y;
    if (x == y) return y;
    if (x == 0.0) return y > 0.0 ? 0x1p-1074 : -0x1p-1074;
    Double next = {.number = x};
    next.bits += (x < y) == (x > 0.0) ? 1 : -1;
    return next.number;
}

double sqrt(double x) { return __builtin_sqrt(x); }
double floor(double x) { return __builtin_floor(x); }
double ceil(double x) { return __builtin_ceil(x); }
double trunc(double x) { return __builtin_trunc(x); }
double rint(double x) { return __builtin_rint(x); }
double fabs(double x) { return __builtin_fabs(x); }

__attribute__((export_name("fma"))) double exported_fma(double a, double b, double c) { return fma(a, b, c); }
