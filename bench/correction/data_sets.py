"""The plant data of ../shared/data/plant-a under other names, for benches that let a plant work on it more than once."""
import json
import os

PLANT = os.path.abspath('../shared/data/plant-a')


def is_there():
    if os.path.exists(f'{PLANT}/dataset.json'):
        return True
    print(f'SKIPPED: {PLANT} is absent')
    return False


def renamed(what, names):
    """names: what each text is called instead."""
    if isinstance(what, str):
        return names.get(what, what)
    if isinstance(what, list):
        return [renamed(one, names) for one in what]
    return {key: renamed(one, names) for key, one in what.items()} if isinstance(what, dict) else what


def put(folder, names=None, wanted=lambda scan: True):
    """The data set in a new folder, with other names and those scans that are wanted."""
    os.mkdir(folder)
    for name in os.listdir(PLANT):
        if name != 'dataset.json':
            os.symlink(os.path.join(PLANT, name), os.path.join(folder, name))
    dataset = json.load(open(f'{PLANT}/dataset.json'))
    dataset['scans'] = [scan for scan in dataset['scans'] if wanted(scan)]
    json.dump(renamed(dataset, names or {}), open(f'{folder}/dataset.json', 'w'))
    return folder


def scan_names(suffix):
    return {scan['id']: scan['id'] + suffix for scan in json.load(open(f'{PLANT}/dataset.json'))['scans']}
