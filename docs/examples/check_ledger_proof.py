#!/usr/bin/python3
"""usage: check_ledger_proof.py PROOF.json PUBLIC_KEY.pem [HEADS.jsonl]

Whether a proof of `sixpoint ledger proof` holds, by nothing of the plant's: Python's standard library, and openssl for the signature.
PUBLIC_KEY.pem and HEADS.jsonl are yours, from when the plant was trusted, not the plant's of today. Says what is proven and ends with 0;
says what is wrong and ends with 1; where all that is shown is as it was sealed, but not all is shown, ends with 2. docs/ledger.md has the
formats."""
import hashlib
import json
import subprocess
import sys
import tempfile


class Wrong(Exception):
    pass


def sha256(data):
    return hashlib.sha256(data).digest()


def want(holds, sentence):
    if not holds:
        raise Wrong(sentence)


def signed_text(head):
    return ('sixpoint-ledger-head-1\n' + ''.join(f'{head[key]}\n' for key in (
        'plant_id', 'tree_size', 'root_sha256', 'record_sequence', 'signed_at'))).encode()


def check_signature(head, key_file):
    with tempfile.NamedTemporaryFile() as text, tempfile.NamedTemporaryFile() as signature:
        text.write(signed_text(head))
        text.flush()
        signature.write(bytes.fromhex(head['signature']))
        signature.flush()
        checked = subprocess.run(['openssl', 'pkeyutl', '-verify', '-pubin', '-inkey', key_file, '-rawin', '-in', text.name,
                                  '-sigfile', signature.name], capture_output=True, text=True)
    want(checked.returncode == 0, f'the head is not signed by the key in {key_file}')


def root_by(leaf, index, size, path):
    """RFC 9162, 2.1.3.2."""
    want(0 <= index < size, f'leaf {index} of {size}')
    node, at, last = leaf, index, size - 1
    for beside in path:
        want(last > 0, 'the path is too long')
        if at % 2 == 1 or at == last:
            node = sha256(b'\x01' + beside + node)
            while at % 2 == 0 and at != 0:
                at, last = at // 2, last // 2
        else:
            node = sha256(b'\x01' + node + beside)
        at, last = at // 2, last // 2
    want(last == 0, 'the path is too short')
    return node


def check_content(entry):
    """The rows against the digests of their tables; which tables stand there whole, and which not."""
    whole, missing, name = [], [], entry['name']
    listed = {}
    for line in entry['content'].splitlines():
        table, count, digest = line.split(' ')
        listed[table] = (int(count), digest)
    for table in entry['tables']:
        want(table in listed, f'{name}: {table} was not sealed with it')
    for table, (count, digest) in listed.items():
        rows = entry['tables'].get(table, [])
        if not rows:
            missing.append(f'{count} {table} NOT SHOWN')  # too many to be sent, or taken out
            continue
        digests = sorted(sha256(row.encode()) for row in rows)
        want(len(rows) == count and sha256(b''.join(digests)).hex() == digest, f'{name}: rows of {table} are not those that were sealed')
        whole.append(f'{count} {table}')
    return whole, missing


def check_entry(entry, head):
    name = entry['name']
    lines = entry['leaf'].split('\n')
    want(len(lines) == 6 and lines[0] == 'sixpoint-ledger-leaf-1' and lines[5] == '', f'{name}: a leaf of another format')
    _, sequence, record_id, name_digest, content_digest, _ = lines
    leaf = sha256(b'\x00' + entry['leaf'].encode())
    root = root_by(leaf, entry['leaf_index'], head['tree_size'], [bytes.fromhex(one) for one in entry['audit_path']])
    want(root.hex() == head['root_sha256'], f'{name}: its leaf is not in the tree that was signed')
    want(sha256(entry['name_row'].encode()).hex() == name_digest, f'{name}: its name is not the one that was sealed')
    row = json.loads(entry['name_row'])
    want((row['name'], row['record_id'], row['record_sequence']) == (name, record_id, sequence) and
         entry['record_sequence'] == int(sequence), f'{name}: another entry was sealed')
    want(sha256(entry['content'].encode()).hex() == content_digest, f'{name}: its tables are not those that were sealed')
    return row, *check_content(entry)


def check(proof, key_file, heads_file):
    want(proof.get('format') == 'sixpoint-ledger-proof-1', 'want a proof of format sixpoint-ledger-proof-1')
    head = proof['head']
    check_signature(head, key_file)
    if heads_file:
        with open(heads_file) as file:
            known = [json.loads(line) for line in file if line.strip()]
        same = [one for one in known if one['plant_id'] == head['plant_id'] and one['tree_size'] == head['tree_size']]
        want(all(one['root_sha256'] == head['root_sha256'] for one in same), 'another root was sent out for as many entries')
        print(f"the head is {'one of those' if same else 'NOT among those'} in {heads_file}")
    print(f"{proof['blade']}, in the ledger of plant {head['plant_id']} as it was signed {head['signed_at']}:")
    want(proof['entries'], 'no entries')
    sequences = [entry['record_sequence'] for entry in proof['entries']]
    want(sequences == sorted(set(sequences)), 'entries are not in their order')
    not_shown = 0
    for entry in proof['entries']:
        row, whole, missing = check_entry(entry, head)
        # The one row that says which blade it is of: without it anybody's entry could stand here.
        of = [json.loads(one).get('blade_serial') for one in entry['tables'].get('record_entries', [])]
        want(of, f"{entry['name']}: its row of record_entries is not shown")
        want(of == [proof['blade'].split('/', 1)[1]], f"{entry['name']}: an entry of another blade")
        print(f"  {row['record_sequence']:>9} {row['recorded_at']}  {row['name']}: {', '.join(whole + missing)}")
        not_shown += len(missing)
    if proof.get('unsealed_count'):
        print(f"  and {proof['unsealed_count']} entries, by the plant's word, that were not sealed yet")
    return not_shown


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__.splitlines()[0])
    try:
        with open(sys.argv[1]) as file:
            not_shown = check(json.load(file), sys.argv[2], sys.argv[3] if len(sys.argv) == 4 else None)
    except (Wrong, KeyError, IndexError, TypeError, ValueError, AttributeError, OSError) as wrong:
        print(f'does NOT hold: {wrong if isinstance(wrong, (Wrong, OSError)) else f"no proof: {wrong!r}"}')
        sys.exit(1)
    print('each entry was sealed as it stands here; that these are all entries of the blade is not proven')
    if not_shown:
        print(f'NOT whole: what is shown is as it was sealed, and the rows of {not_shown} tables are NOT SHOWN')
        sys.exit(2)
    print('holds')


main()
