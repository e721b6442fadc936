/* Calls kernels that were compiled ahead of time.

   The builder (build.py) writes table.h, compiles this file and links it with the code of the kernels.  Nothing but a
   few functions of Python's stable interface is used, declared here, so that the bytes depend on no header.  Objects of
   numpy are read by the layout that its compiled users rely on; library.py checks it when the library is loaded.

   A kernel takes its arguments as a row of 64-bit slots: numbers as they are, an array as its owner, its object, number
   of items, bytes of an item, data, shape and strides, a tuple as its items.  Results come back in the same way. */

#include "support.h"

/* -- Python ------------------------------------------------------------------------------------------------------- */

typedef struct PyObject { intptr_t count; struct PyObject *type; } PyObject;
typedef struct { const char *name; PyObject *(*call)(PyObject *, PyObject *); int flags; const char *doc; } Method;
typedef struct { int slot; void *function; } Slot;
typedef struct { const char *name; int basicsize, itemsize; unsigned flags; const Slot *slots; } Spec;
typedef struct {
    PyObject base; void *init; intptr_t index; PyObject *copy;
    const char *name, *doc; intptr_t size; const Method *methods; void *slots, *traverse, *clear, *free;
} Module;

enum { TP_CALL = 50, TP_INIT = 60, TP_METHODS = 64, VARARGS = 1, NOARGS = 4, ONE = 8, BASETYPE = 1 << 10 };

extern PyObject PyTuple_Type, PyLong_Type, PyFloat_Type, PyComplex_Type, PyBool_Type;
extern PyObject _Py_NoneStruct, _Py_TrueStruct, _Py_FalseStruct;
extern PyObject *PyExc_TypeError, *PyExc_SystemError;
PyObject *PyModule_Create2(Module *, int);
PyObject *PyType_FromSpec(Spec *);
int PyModule_AddObjectRef(PyObject *, const char *, PyObject *);
void Py_IncRef(PyObject *);
void Py_DecRef(PyObject *);
intptr_t PyTuple_Size(PyObject *);
PyObject *PyTuple_GetItem(PyObject *, intptr_t);
PyObject *PyTuple_New(intptr_t);
int PyTuple_SetItem(PyObject *, intptr_t, PyObject *);
intptr_t PyDict_Size(PyObject *);
int PyType_IsSubtype(PyObject *, PyObject *);
long long PyLong_AsLongLongAndOverflow(PyObject *, int *);
unsigned long long PyLong_AsUnsignedLongLong(PyObject *);
PyObject *PyLong_FromLongLong(long long);
PyObject *PyLong_FromUnsignedLongLong(unsigned long long);
double PyFloat_AsDouble(PyObject *);
PyObject *PyFloat_FromDouble(double);
double PyComplex_RealAsDouble(PyObject *);
double PyComplex_ImagAsDouble(PyObject *);
PyObject *PyComplex_FromDoubles(double, double);
PyObject *PyUnicode_FromString(const char *);
int PyUnicode_CompareWithASCIIString(PyObject *, const char *);
PyObject *PyBytes_FromStringAndSize(const char *, intptr_t);
PyObject *PyObject_Call(PyObject *, PyObject *, PyObject *);
PyObject *PyObject_CallFunctionObjArgs(PyObject *, ...);
PyObject *PyObject_GetAttrString(PyObject *, const char *);
PyObject *Py_BuildValue(const char *, ...);
int PyArg_ParseTuple(PyObject *, const char *, ...);
PyObject *PyCapsule_New(void *, const char *, void (*)(PyObject *));
void *PyCapsule_GetPointer(PyObject *, const char *);
void PyErr_SetString(PyObject *, const char *);
void PyErr_Clear(void);
PyObject *PyErr_NoMemory(void);

/* -- numpy -------------------------------------------------------------------------------------------------------- */

typedef struct { PyObject head; PyObject *scalar; char kind, code, order, unused; int number; } Dtype;
typedef struct {
    PyObject head; void *data; int ndim; intptr_t *shape, *strides; PyObject *base; Dtype *dtype; int flags;
} Array;
enum { C_ORDER = 1, F_ORDER = 2, ALIGNED = 0x100, WRITEABLE = 0x400 };

typedef PyObject *(*NewArray)(PyObject *, Dtype *, int, const intptr_t *, const intptr_t *, void *, int, PyObject *);
typedef Dtype *(*DtypeOf)(int);
typedef int (*SetBase)(PyObject *, PyObject *);
static NewArray new_array;
static DtypeOf dtype_of;
static SetBase set_base;
static PyObject *array_type, *scalar_types[16];

/* -- memory that kernels return ------------------------------------------------------------------------------------- */

static void drop(Owner *owner) {
    if (__atomic_sub_fetch(&owner->count, 1, __ATOMIC_ACQ_REL) == 0) NRT_MemInfo_call_dtor(owner);
}

static void drop_capsule(PyObject *capsule) { drop(PyCapsule_GetPointer(capsule, NULL)); }

/* -- table of the kernels --------------------------------------------------------------------------------------------- */

typedef int32_t (*Entry)(const uint64_t *, uint64_t *, void **);
typedef struct { const char *types, *result, *text; Entry code[LEVELS]; uint64_t calls; } Overload;
typedef struct { const char *name, *digest; int first, count; } Kernel;
typedef struct { const char *name, *fields; PyObject *seen; } Named;
#include "table.h"  /* MAX_IN, MAX_OUT, MAX_ARRAYS, KERNELS, kernels[], overloads[], named[] */

static int level; /* of the code that this processor runs */
static PyObject *bind_hook, *raise_hook;

typedef struct { PyObject head; const Kernel *kernel; PyObject *fallback; int state, last; } Callable;
enum { NEW, NATIVE, OTHER };

typedef struct {
    uint64_t *next;          /* slot to fill */
    PyObject **objects;      /* arrays among the arguments */
    Owner *owners;           /* their owners, on the stack, where arrays are returned */
    int arrays;
} Call;

/* -- arguments -------------------------------------------------------------------------------------------------------- */

/* numpy's type numbers: the letter of each in the descriptions of types, and the other number of the same size */
#ifdef _WIN32
static const char LETTERS[] = "?bBhHiIiIlLfdxFD", SIZES[] = {1, 1, 1, 2, 2, 4, 4, 4, 4, 8, 8, 4, 8, 16, 8, 16};
#else
static const char LETTERS[] = "?bBhHiIlLlLfdxFD", SIZES[] = {1, 1, 1, 2, 2, 4, 4, 8, 8, 8, 8, 4, 8, 16, 8, 16};
#endif

static int scalar(char letter, PyObject *object, Call *call) {
    PyObject *type = object->type;
    uint64_t *slot = call->next++;
    if (type == &PyFloat_Type) {
        if (letter != 'd') return 0;
        *(double *)slot = PyFloat_AsDouble(object);
        return 1;
    }
    if (type == &PyLong_Type) {
        int over;
        long long value = PyLong_AsLongLongAndOverflow(object, &over);
        if (letter == 'l' && !over) { *slot = (uint64_t)value; return 1; }
        if (letter != 'L' || over <= 0) return 0;
        *slot = PyLong_AsUnsignedLongLong(object);
        if (*slot >> 63) return 1;
        return 0;
    }
    if (type == &PyComplex_Type) {
        if (letter != 'D') return 0;
        ((double *)slot)[0] = PyComplex_RealAsDouble(object);
        ((double *)call->next++)[0] = PyComplex_ImagAsDouble(object);
        return 1;
    }
    if (type == &PyBool_Type) {
        if (letter != '?') return 0;
        *slot = object == &_Py_TrueStruct;
        return 1;
    }
    for (int k = 0; k < 16; k++) {
        if (type != scalar_types[k] || !type || LETTERS[k] != letter) continue;
        void *value = object + 1;
        switch (letter) {
            case '?': case 'B': *slot = *(uint8_t *)value; return 1;
            case 'b': *slot = (uint64_t)*(int8_t *)value; return 1;
            case 'h': *slot = (uint64_t)*(int16_t *)value; return 1;
            case 'H': *slot = *(uint16_t *)value; return 1;
            case 'i': *slot = (uint64_t)*(int32_t *)value; return 1;
            case 'I': case 'f': *slot = *(uint32_t *)value; return 1;
            case 'l': case 'L': case 'd': *slot = *(uint64_t *)value; return 1;
            case 'D': slot[0] = ((uint64_t *)value)[0]; *call->next++ = ((uint64_t *)value)[1]; return 1;
        }
    }
    return 0;
}

/* "A" letter ndim layout w|r; code that only reads takes any array, unless it may return a part of it */
static int array(const char *type, PyObject *object, Call *call) {
    if (object->type != array_type) return 0;
    Array *a = (Array *)object;
    int ndim = type[2] - '0', number = a->dtype->number, flags = a->flags;
    if (a->ndim != ndim || (unsigned)number > 15 || LETTERS[number] != type[1]) return 0;
    char layout = flags & C_ORDER ? 'C' : flags & F_ORDER ? 'F' : 'A';
    if (layout != type[3] || !(flags & ALIGNED)) return 0;
    if (flags & WRITEABLE ? type[4] == 'r' && call->owners : type[4] == 'w') return 0;
    if (a->dtype->order != '=' && a->dtype->order != '|') return 0;
    uint64_t *slot = call->next;
    intptr_t items = 1;
    for (int k = 0; k < ndim; k++) {
        slot[5 + k] = (uint64_t)a->shape[k];
        slot[5 + ndim + k] = (uint64_t)a->strides[k];
        items *= a->shape[k];
    }
    slot[0] = slot[1] = 0;
    if (call->owners) {
        Owner *owner = call->owners + call->arrays;
        *owner = (Owner){1, NULL, NULL, a->data, 0, NULL};
        slot[0] = (uint64_t)(uintptr_t)owner;
        slot[1] = (uint64_t)(uintptr_t)object;
        call->objects[call->arrays] = object;
    }
    call->arrays++;
    slot[2] = (uint64_t)items;
    slot[3] = (uint64_t)SIZES[number];
    slot[4] = (uint64_t)(uintptr_t)a->data;
    call->next = slot + 5 + 2 * ndim;
    return 1;
}

/* Whether the class of a tuple has the name and the fields of a named tuple of the table. */
static int is_named(Named *known, PyObject *type) {
    if (known->seen == type) return 1;
    if (!PyType_IsSubtype(type, &PyTuple_Type)) return 0;
    PyObject *name = PyObject_GetAttrString(type, "__name__");
    PyObject *fields = name ? PyObject_GetAttrString(type, "_fields") : NULL;
    PyObject *comma = fields ? PyUnicode_FromString(",") : NULL;
    PyObject *join = comma ? PyObject_GetAttrString(comma, "join") : NULL;
    PyObject *joined = join ? PyObject_CallFunctionObjArgs(join, fields, NULL) : NULL;
    int same = joined && !PyUnicode_CompareWithASCIIString(name, known->name)
        && !PyUnicode_CompareWithASCIIString(joined, known->fields);
    PyObject *all[] = {name, fields, comma, join, joined};
    for (int k = 0; k < 5; k++) if (all[k]) Py_DecRef(all[k]);
    if (!joined) PyErr_Clear();
    if (same) {
        Py_IncRef(type);
        known->seen = type;
    }
    return same;
}

static int match(const char **types, PyObject *object, Call *call);

static int items(const char **types, PyObject *tuple, Call *call) {
    intptr_t count = PyTuple_Size(tuple), k = 0;
    for (; **types != ')'; k++)
        if (k >= count || !match(types, PyTuple_GetItem(tuple, k), call)) return 0;
    (*types)++;
    return k == count;
}

static int match(const char **types, PyObject *object, Call *call) {
    const char *type = *types;
    switch (*type) {
        case 'A':
            *types += 5;
            return array(type, object, call);
        case 'N':
            *types += 1;
            *call->next++ = 0;
            return object == &_Py_NoneStruct;
        case '(':
            *types += 1;
            return object->type == &PyTuple_Type && items(types, object, call);
        case '<': /* two digits: which of the named tuples */
            *types += 3;
            return is_named(&named[(type[1] - '0') * 10 + type[2] - '0'], object->type) && items(types, object, call);
    }
    *types += 1;
    return scalar(*type, object, call);
}

/* Fill the slots; false where the arguments are of other types. */
static int arguments(const Overload *overload, PyObject *args, Call *call) {
    const char *types = overload->types;
    intptr_t count = PyTuple_Size(args), k = 0;
    for (; *types && *types != 'O'; k++)
        if (k >= count || !match(&types, PyTuple_GetItem(args, k), call)) return 0;
    return k == count; /* what is left has its default value */
}

/* -- results ---------------------------------------------------------------------------------------------------------- */

static PyObject *boxed(const char **types, uint64_t **slots, Call *call);

static PyObject *boxed_array(const char *type, uint64_t **slots, Call *call) {
    uint64_t *slot = *slots;
    int ndim = type[2] - '0', number = 0;
    *slots += 5 + 2 * ndim;
    while (LETTERS[number] != type[1]) number++;
    Owner *owner = (Owner *)(uintptr_t)slot[0];
    PyObject *base = NULL;
    for (int k = 0; k < call->arrays; k++)
        if (owner == call->owners + k) base = call->objects[k];
    if (base) {
        Array *a = (Array *)base;
        int same = (uint64_t)(uintptr_t)a->data == slot[4] && a->ndim == ndim;
        for (int k = 0; same && k < ndim; k++)
            same = (uint64_t)a->shape[k] == slot[5 + k] && (uint64_t)a->strides[k] == slot[5 + ndim + k];
        Py_IncRef(base);
        if (same) return base; /* the argument itself */
    } else if (owner) {
        base = PyCapsule_New(owner, NULL, drop_capsule);
        if (!base) { drop(owner); return NULL; }
    }
    int flags = type[4] == 'w' ? WRITEABLE : 0;
    PyObject *found = new_array(array_type, dtype_of(number), ndim, (intptr_t *)slot + 5, (intptr_t *)slot + 5 + ndim,
                                (void *)(uintptr_t)slot[4], flags | ALIGNED, NULL);
    if (!found) { if (base) Py_DecRef(base); return NULL; }
    if (base && set_base(found, base) < 0) { Py_DecRef(found); return NULL; }
    return found;
}

static PyObject *boxed_tuple(const char **types, uint64_t **slots, Call *call) {
    const char *ahead = *types;
    intptr_t count = 0;
    for (int depth = 0; depth || *ahead != ')'; ahead++) {
        if (*ahead == '(') depth++;
        if (*ahead == ')') depth--;
        if (*ahead == 'A') ahead += 4;
        if (!depth) count++;
    }
    PyObject *tuple = PyTuple_New(count);
    for (intptr_t k = 0; k < count; k++) {
        PyObject *item = boxed(types, slots, call);
        if (!tuple) { if (item) Py_DecRef(item); continue; }
        if (item) PyTuple_SetItem(tuple, k, item);
        else { Py_DecRef(tuple); tuple = NULL; }
    }
    (*types)++;
    return tuple;
}

static PyObject *boxed(const char **types, uint64_t **slots, Call *call) {
    const char *type = *types;
    if (*type == 'A') { *types += 5; return boxed_array(type, slots, call); }
    *types += 1;
    if (*type == '(') return boxed_tuple(types, slots, call);
    uint64_t value = *(*slots)++;
    PyObject *constant = NULL;
    switch (*type) {
        case 'd': return PyFloat_FromDouble(*(double *)&value);
        case 'D': return PyComplex_FromDoubles(*(double *)&value, *(double *)(*slots)++);
        case 'f': return PyFloat_FromDouble(*(float *)&value);
        case 'b': return PyLong_FromLongLong((int8_t)value);
        case 'h': return PyLong_FromLongLong((int16_t)value);
        case 'i': return PyLong_FromLongLong((int32_t)value);
        case 'l': return PyLong_FromLongLong((int64_t)value);
        case 'B': case 'H': case 'I': case 'L': return PyLong_FromUnsignedLongLong(value);
        case '?': constant = value & 1 ? &_Py_TrueStruct : &_Py_FalseStruct; break;
        case 'N': constant = &_Py_NoneStruct; break;
        default: PyErr_SetString(PyExc_SystemError, "unknown type of a result"); return NULL;
    }
    Py_IncRef(constant);
    return constant;
}

static PyObject *failed(int32_t code, void *about) {
    struct { const char *data; int32_t size; } *told = about;
    if (code > 0 && told) {
        PyObject *bytes = PyBytes_FromStringAndSize(told->data, told->size);
        if (!bytes) return NULL;
        PyObject *never = PyObject_CallFunctionObjArgs(raise_hook, bytes, NULL);
        Py_DecRef(bytes);
        if (never) Py_DecRef(never);
        else return NULL;
    }
    PyErr_SetString(PyExc_SystemError, "a compiled kernel failed without saying why");
    return NULL;
}

/* -- the call --------------------------------------------------------------------------------------------------------- */

static PyObject *run(Overload *overload, uint64_t *in, Call *call) {
    uint64_t out[MAX_OUT], *slots = out;
    const char *types = overload->result;
    void *about = NULL;
    int32_t code = overload->code[level](in, out, &about);
    if (code != 0 && code != -2) return failed(code, about);
    return boxed(&types, &slots, call);
}

static PyObject *call_kernel(PyObject *self, PyObject *args, PyObject *keywords) {
    Callable *me = (Callable *)self;
    if (me->state == NEW) {
        PyObject *done = PyObject_CallFunctionObjArgs(bind_hook, self, NULL);
        if (!done) return NULL;
        me->state = done == &_Py_TrueStruct ? NATIVE : OTHER;
        Py_DecRef(done);
    }
    if (me->state == NATIVE && (!keywords || PyDict_Size(keywords) == 0)) {
        uint64_t in[MAX_IN];
        PyObject *objects[MAX_ARRAYS];
        Owner owners[MAX_ARRAYS];
        int count = me->kernel->count;
        for (int k = 0, which = me->last; k < count; k++, which = which + 1 < count ? which + 1 : 0) {
            Overload *overload = &overloads[me->kernel->first + which];
            Call call = {in, objects, NULL, 0};
            for (const char *c = overload->result; *c; c++) if (*c == 'A') call.owners = owners;
            if (!arguments(overload, args, &call)) continue;
            me->last = which;
            overload->calls++;
            return run(overload, in, &call);
        }
    }
    if (me->fallback) return PyObject_Call(me->fallback, args, keywords);
    PyObject *other = PyObject_GetAttrString(self, "fallback");
    if (!other) return NULL;
    PyObject *found = PyObject_Call(other, args, keywords);
    Py_DecRef(other);
    return found;
}

static int init(PyObject *self, PyObject *args, PyObject *keywords) {
    Callable *me = (Callable *)self;
    const char *name;
    if (!PyArg_ParseTuple(args, "s", &name)) return -1;
    me->state = OTHER;
    for (int low = 0, high = KERNELS; low < high;) {
        int middle = (low + high) / 2, order = 0;
        const char *a = name, *b = kernels[middle].name;
        while (*a && *a == *b) a++, b++;
        order = (unsigned char)*a - (unsigned char)*b;
        if (order == 0) { me->kernel = &kernels[middle]; me->state = NEW; break; }
        if (order < 0) high = middle;
        else low = middle + 1;
    }
    return 0;
}

/* Set what is called where no compiled code fits; the caller keeps it alive. */
static PyObject *set_fallback(PyObject *self, PyObject *fallback) {
    ((Callable *)self)->fallback = fallback;
    Py_IncRef(&_Py_NoneStruct);
    return &_Py_NoneStruct;
}

static PyObject *described(const Kernel *kernel) {
    PyObject *parts = PyTuple_New(kernel->count);
    for (int k = 0; parts && k < kernel->count; k++) {
        const Overload *overload = &overloads[kernel->first + k];
        PyTuple_SetItem(parts, k, Py_BuildValue("(sL)", overload->text, (long long)overload->calls));
    }
    return parts ? Py_BuildValue("(ssN)", kernel->name, kernel->digest, parts) : NULL;
}

/* (name, digest, ((types, calls), ...)) of this kernel, None for one that is not in the library. */
static PyObject *entry(PyObject *self, PyObject *unused) {
    const Kernel *kernel = ((Callable *)self)->kernel;
    if (kernel) return described(kernel);
    Py_IncRef(&_Py_NoneStruct);
    return &_Py_NoneStruct;
}

/* -- the module ------------------------------------------------------------------------------------------------------- */

/* What is asked at the first call of a kernel, and what raises; returns the version of the code. */
static PyObject *set_hooks(PyObject *module, PyObject *args) {
    if (!PyArg_ParseTuple(args, "OO", &bind_hook, &raise_hook)) return NULL;
    Py_IncRef(args); /* kept for good */
    return Py_BuildValue("i", level);
}

/* numpy's array type, the scalar types by number and the table of its functions */
static PyObject *set_numpy(PyObject *module, PyObject *args) {
    PyObject *types, *table;
    if (!PyArg_ParseTuple(args, "OOO", &array_type, &types, &table)) return NULL;
    void **functions = PyCapsule_GetPointer(table, NULL);
    if (!functions) return NULL;
    Py_IncRef(args); /* kept for good */
    for (int k = 0; k < 16; k++) {
        PyObject *type = PyTuple_GetItem(types, k);
        if (!type) return NULL;
        scalar_types[k] = type == &_Py_NoneStruct ? NULL : type;
    }
    dtype_of = (DtypeOf)functions[45];
    new_array = (NewArray)functions[94];
    set_base = (SetBase)functions[282];
    Py_IncRef(&_Py_NoneStruct);
    return &_Py_NoneStruct;
}

/* What is read of an array: (data, ndim, shape and stride of the first axis, number of its type, order, flags). */
static PyObject *peek(PyObject *module, PyObject *object) {
    Array *a = (Array *)object;
    return Py_BuildValue("(LiLLiii)", (long long)(intptr_t)a->data, a->ndim, (long long)a->shape[0],
                         (long long)a->strides[0], a->dtype->number, a->dtype->order,
                         a->flags & (C_ORDER | F_ORDER | ALIGNED | WRITEABLE));
}

static PyObject *contents(PyObject *module, PyObject *unused) {
    PyObject *all = PyTuple_New(KERNELS);
    for (int k = 0; all && k < KERNELS; k++) PyTuple_SetItem(all, k, described(&kernels[k]));
    return all;
}

static PyObject *set_level(PyObject *module, PyObject *args) {
    int wanted;
    if (!PyArg_ParseTuple(args, "i", &wanted)) return NULL;
    level = wanted;
    return Py_BuildValue("i", level);
}

static PyObject *software_fma(PyObject *module, PyObject *args) {
    double a, b, c;
    if (!PyArg_ParseTuple(args, "ddd", &a, &b, &c)) return NULL;
    return PyFloat_FromDouble(fma(a, b, c));
}

static const Method methods[] = {
    {"set_hooks", set_hooks, VARARGS, NULL}, {"set_numpy", set_numpy, VARARGS, NULL}, {"peek", peek, ONE, NULL}, {"contents", contents, NOARGS, NULL},
    {"set_level", set_level, VARARGS, NULL}, {"fma", software_fma, VARARGS, NULL}, {NULL, NULL, 0, NULL}};
static const Method kernel_methods[] = {
    {"set_fallback", set_fallback, ONE, NULL}, {"entry", entry, NOARGS, NULL}, {NULL, NULL, 0, NULL}};
static const Slot slots[] = {
    {TP_CALL, call_kernel}, {TP_INIT, init}, {TP_METHODS, (void *)kernel_methods}, {0, NULL}};
static Spec spec = {"graphsynth.core.native.Native", sizeof(Callable), 0, BASETYPE, slots};
static Module definition = {{1, NULL}, NULL, 0, NULL, "library", NULL, -1, methods, NULL, NULL, NULL, NULL};

#if defined(__x86_64__)
static void cpuid(unsigned leaf, unsigned *r) {
    __asm__("cpuid" : "=a"(r[0]), "=b"(r[1]), "=c"(r[2]), "=d"(r[3]) : "a"(leaf), "c"(0));
}

/* 1: x86-64-v3 (AVX2, FMA, BMI), 0: x86-64-v2, -1: less */
static int processor(void) {
    unsigned one[4], seven[4], more[4], low, high;
    cpuid(0, one);
    if (one[0] < 7) return -1;
    cpuid(1, one);
    cpuid(7, seven);
    cpuid(0x80000001u, more);
    unsigned basic = 1u << 0 | 1u << 9 | 1u << 13 | 1u << 19 | 1u << 20 | 1u << 23; /* SSE3, SSSE3, CX16, SSE4, POPCNT */
    if ((one[2] & basic) != basic || !(more[2] & 1)) return -1;
    unsigned wide = 1u << 12 | 1u << 22 | 1u << 27 | 1u << 28 | 1u << 29; /* FMA, MOVBE, OSXSAVE, AVX, F16C */
    unsigned also = 1u << 3 | 1u << 5 | 1u << 8;                             /* BMI1, AVX2, BMI2 */
    if ((one[2] & wide) != wide || (seven[1] & also) != also || !(more[2] & 1u << 5)) return 0;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return (low & 6) == 6;
}
#else
static int processor(void) { return 0; }
#endif

__attribute__((visibility("default"))) PyObject *PyInit__library(void) {
    level = processor();
    if (level < 0) {
        PyErr_SetString(PyExc_SystemError, "the processor is older than x86-64-v2");
        return NULL;
    }
    PyObject *module = PyModule_Create2(&definition, 3);
    PyObject *type = module ? PyType_FromSpec(&spec) : NULL;
    if (!type || PyModule_AddObjectRef(module, "Native", type) < 0) return NULL;
    return module;
}
