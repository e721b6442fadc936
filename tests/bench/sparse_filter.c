/* The baseline of the benchmarks: keeps the graph6 lines of standard input that have no rigid sub-chain.

   A (3,4) pebble game (A. Lee, I. Streinu, Discrete Math. 308 (2008) 1425-1437): every joint stands for two parallel
   edges, so that every set of n' links has 2 e' <= 3 n' - 4.  Each link owns three pebbles; an edge may be inserted
   when five pebbles can be gathered at its ends.  Prints the lines kept, or with the argument "-u" only their number. */

#include <stdio.h>
#include <string.h>

enum { MAXN = 32, PEBBLES = 3, GATHER = 5 };

static int out[MAXN][PEBBLES], spent[MAXN];

/* Bring one more pebble to a along a path that avoids b. */
static int fetch(int a, int b) {
    int from[MAXN], slot[MAXN], stack[MAXN], top = 0;
    unsigned seen = 1u << a | 1u << b;
    stack[top++] = a;
    while (top) {
        int v = stack[--top];
        for (int i = 0; i < spent[v]; i++) {
            int w = out[v][i];
            if (seen >> w & 1) continue;
            seen |= 1u << w;
            from[w] = v, slot[w] = i;
            if (spent[w] < PEBBLES) {
                /* turn the path around; each inner link loses one edge and gains one */
                int target = from[w], at = slot[w];
                out[w][spent[w]++] = target;
                for (int x = target; x != a; x = target) {
                    target = from[x];
                    out[x][at] = target;
                    at = slot[x];
                }
                out[a][at] = out[a][--spent[a]];
                return 1;
            }
            stack[top++] = w;
        }
    }
    return 0;
}

static int insert(int a, int b) {
    while (2 * PEBBLES - spent[a] - spent[b] < GATHER) {
        if (spent[a] && fetch(a, b)) continue;
        if (spent[b] && fetch(b, a)) continue;
        return 0;
    }
    if (spent[a] == PEBBLES) {
        int t = a;
        a = b, b = t;
    }
    out[a][spent[a]++] = b;
    return 1;
}

static int sparse(const char *line) {
    int n = line[0] - 63, at = 0;
    memset(spent, 0, sizeof spent);
    for (int b = 1; b < n; b++)
        for (int a = 0; a < b; a++, at++)
            if ((line[1 + at / 6] - 63) >> (5 - at % 6) & 1)
                if (!insert(a, b) || !insert(a, b)) return 0;
    return 1;
}

int main(int count, char **words) {
    int quiet = count > 1 && !strcmp(words[1], "-u");
    long long kept = 0;
    char line[1024];
    while (fgets(line, sizeof line, stdin)) {
        if (!sparse(line)) continue;
        kept++;
        if (!quiet) fputs(line, stdout);
    }
    if (quiet) printf("%lld\n", kept);
    return 0;
}
