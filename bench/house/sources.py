"""What a reader finds in the sources: long files, long functions, guards, fields that nothing is said of."""
import re
import subprocess

PRODUCT = ['refusal', 'identity', 'ledger', 'metrology', 'services', 'storage', 'sandbox', 'exchange', 'report', 'cli', 'seed', 'simulator']


def listed(*patterns):
    return subprocess.check_output(['git', 'ls-files', *patterns], text=True).split()


def product_sources():
    return [path for path in listed(*PRODUCT) if path.endswith(('.cc', '.h'))]


def read(path):
    return open(path, encoding='utf-8').read()


def files_over(lines):
    return [f'{path} {count}' for path in product_sources() if (count := read(path).count('\n')) > lines]


def without_words(text):
    """The code without comments, literals and directives; every line stays where it is."""
    literal = r'R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*.*?\*/'
    text = re.sub(literal, lambda found: '\n' * found[0].count('\n'), text, flags=re.S)
    return re.sub(r'^[ \t]*#(?:[^\n]*\\\n)*[^\n]*', lambda found: '\n' * found[0].count('\n'), text, flags=re.M)


def functions(path):
    """(first line, lines) of every function that stands in a namespace or a class; what is inside belongs to it."""
    code = without_words(read(path))
    depth, head, body = 0, 0, None  # body: where a function or an initialiser began, and at which depth
    for here, character in enumerate(code):
        if character == '{':
            before = re.sub(r'template\s*<[^{]*?>(?=\s*\w)', '', code[head:here])
            is_scope = re.match(r'\s*(inline\s+)?(namespace|class|struct|union|extern)\b', before) and not before.rstrip().endswith('=')
            if body is None and not is_scope:
                first = head + len(code[head:here]) - len(code[head:here].lstrip())
                body = (first, depth, ')' in before and not before.rstrip().endswith('='))
            depth += 1
            head = here + 1
        elif character == '}':
            depth -= 1
            head = here + 1
            if body is not None and depth == body[1]:
                if body[2]:
                    yield code.count('\n', 0, body[0]) + 1, code.count('\n', body[0], here) + 1
                body = None
        elif character == ';' or (character == ':' and re.search(r'\b(public|private|protected)\s*$', code[head:here])):
            head = here + 1


def functions_over(lines):
    return [f'{path}:{first} {count}' for path in product_sources() for first, count in functions(path) if count > lines]


def guards():
    found = []
    for path in listed('CMakeLists.txt', '*/CMakeLists.txt', '*.cmake'):
        found += [f'{path}: {line.strip()}' for line in read(path).splitlines() if re.match(r'\s*if\s*\(.*\b(EXISTS|TARGET)\b', line)]
    return found


def fields_without_comment():
    """Fields and values of enums of our own contract with nothing said before or behind them."""
    silent = []
    for path in listed('proto/sixpoint/*.proto'):
        said = False
        for number, line in enumerate(read(path).splitlines(), 1):
            text = line.strip()
            if re.match(r'(?:\w[\w.<>, ]*\s)?\w+\s*=\s*\d+\s*(\[.*)?;?', text) and not text.startswith(('syntax', 'option', 'package')):
                if not said and '//' not in text:
                    silent.append(f'{path}:{number} {text}')
            said = text.startswith('//')
    return silent
