"""Every kind of tampering that a superuser may think of, committed on copies of a plant and looked for; and what a check costs."""


def told(run, row):
    """run(words...) gives what the program says; row(key, words, value, most) prints a figure. Percent of the kinds found."""
    tampered = run('tamper')
    kinds = tampered['kinds']
    for kind in kinds:
        print(f"{'  ' + kind['what']:72} {'found' if kind['found'] else 'NOT FOUND':>12}", flush=True)
    row('tampering_kinds', 'kinds of tampering by a superuser of the database', len(kinds))
    row('tampering_false_alarms', '  tables told of a plant that nobody touched', tampered['false_alarms'], most=0)
    return 100 * sum(kind['found'] for kind in kinds) / len(kinds)


def cost(run, row):
    checked = run('verify')
    if not checked['is_well']:
        raise SystemExit('a plant that nobody touched is told as tampered with')
    per = 1e5 / checked['entries']
    row('ledger_entries', 'entries sealed and checked', checked['entries'])
    row('ledger_seal_s', '  sealed, s per 100,000 entries', per * checked['seal_s'])
    row('ledger_verify_s', '  every row compared, s per 100,000 entries', per * checked['verify_s'])
    row('ledger_read_s', '  the same rows read by plain SQL, s per 100,000 entries', per * checked['sql_s'])
    row('ledger_path_ms', '  the path of one entry, ms', 1e3 * checked['path_s'])
    row('ledger_kept_bytes', '  bytes an entry that stay for ever', checked['kept_bytes'] / checked['entries'])
    row('ledger_month_bytes', '  bytes an entry of contents, that stay too', checked['month_bytes'] / checked['entries'])
    row('ledger_verify_over_sql', '  compared over read', checked['verify_s'] / checked['sql_s'])
