"""What the reference code of EMVA 1288 makes of a set: all its results, without plots; prints seconds of its parts as JSON."""

import json
import logging
import os
import sys
import time
import warnings

warnings.simplefilter("ignore")
begin = time.perf_counter()
from emva1288.process.data import Data1288  # noqa: E402
from emva1288.process.loader import LoadImageData  # noqa: E402
from emva1288.process.parser import ParseEmvaDescriptorFile  # noqa: E402
from emva1288.process.results import Results1288  # noqa: E402

imported = time.perf_counter()
descriptor = sys.argv[1]
images = LoadImageData(ParseEmvaDescriptorFile(descriptor).images, path=os.path.dirname(descriptor), loglevel=logging.ERROR)
loaded = time.perf_counter()
results = Results1288(Data1288(images.data, loglevel=logging.ERROR).data, loglevel=logging.ERROR)
count = len(results.results)
done = time.perf_counter()
json.dump(
    {
        "import_s": imported - begin,
        "load_s": loaded - imported,
        "results_s": done - loaded,
        "count": count,
        "gain": float(results.K),
    },
    sys.stdout,
)
