"""From a task to mechanisms that do it: targets, wishes, the search over chains and dimensions, ranked answers."""
