"""Small systems of linear equations: LU factors with partial pivoting, or L D L' of what is
symmetric and positive; in place.
"""

from compressor.physics._jit import inline_once, jit


@inline_once
def factorize(matrix, pivots):
    """Write the LU factors of a small square matrix in place; return False if it is singular.

    pivots: (n,) integers, written: rows that were exchanged.
    """
    n = pivots.size
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(matrix[i, j]) > abs(matrix[best, j]):
                best = i
        pivots[j] = best
        if not abs(matrix[best, j]) > 0.0:
            return False
        if best != j:
            for m in range(n):
                matrix[j, m], matrix[best, m] = matrix[best, m], matrix[j, m]
        for i in range(j + 1, n):
            matrix[i, j] /= matrix[j, j]
            for m in range(j + 1, n):
                matrix[i, m] -= matrix[i, j] * matrix[j, m]
    return True


@inline_once
def substitute(matrix, pivots, b):
    """Solve with the factors of `factorize`, b (n,) being overwritten by the solution."""
    n = pivots.size
    for j in range(n):
        b[j], b[pivots[j]] = b[pivots[j]], b[j]
    for i in range(n):
        for m in range(i):
            b[i] -= matrix[i, m] * b[m]
    for i in range(n - 1, -1, -1):
        for m in range(i + 1, n):
            b[i] -= matrix[i, m] * b[m]
        b[i] /= matrix[i, i]


@jit
def factorize_positive(matrix, n):
    """Write L and 1 / D of L D L', a symmetric matrix's, in its lower half; or return False.

    So it does where the matrix is not positive. n: rows and columns that count. Needs no pivots
    (Golub and Van Loan, Matrix Computations, 4.1.2 and 4.2).
    """
    # sums, no updates of rows: LLVM makes vector code of those, which is slower for so few numbers
    for i in range(n):
        for j in range(i):
            total = matrix[i, j]
            for m in range(j):
                total -= matrix[i, m] * matrix[j, m]
            matrix[i, j] = total
        total = matrix[i, i]
        for j in range(i):
            scaled = matrix[i, j] * matrix[j, j]
            total -= matrix[i, j] * scaled
            matrix[i, j] = scaled
        if not total > 0.0:
            return False
        matrix[i, i] = 1.0 / total
    return True


@jit
def substitute_positive(matrix, b):
    """Solve with the factors of `factorize_positive`, b (n,) being overwritten by the solution."""
    n = b.size
    for i in range(n):
        total = b[i]
        for m in range(i):
            total -= matrix[i, m] * b[m]
        b[i] = total
    for i in range(n - 1, -1, -1):
        total = b[i] * matrix[i, i]
        for m in range(i + 1, n):
            total -= matrix[m, i] * b[m]
        b[i] = total
